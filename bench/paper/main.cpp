// marrow-paper: repeats Table 1 of Visutsak 2020 with other models and contenders, and draws images like its
// Figure 13.
#include <fmt/format.h>

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "contenders.h"
#include "models.h"
#include "picture.h"

namespace marrow::paper {
namespace {

namespace fs = std::filesystem;

constexpr double kWindow = 3;  // mm, for the roughness

struct Settings {
    fs::path data, out;
    int rounds = 21;
    bool pictures = true;
};

/// The results of one contender on one model.
struct Row {
    std::string model, contender;
    Mesh mesh;
    double milliseconds;  // median
    Roughness rough;
    double smallest_angle;  // degrees
    MeshDistance distance;  // from the surface of Marrow without snapping
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

// Runs every contender once per round with one thread, so that a temporary slowdown affects them all.
std::vector<Row> run_contenders(const Model& model, int rounds) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const std::vector<Contender> contenders = make_contenders(model.volume, model.isovalue);
    std::vector<std::vector<double>> times(contenders.size());
    std::vector<Row> rows(contenders.size());
    for (int round = -1; round < rounds; ++round) {  // the first round is not counted
        for (std::size_t a = 0; a < contenders.size(); ++a) {
            double milliseconds = 0;
            rows[a].mesh = contenders[a].run(milliseconds);
            if (round >= 0) times[a].push_back(milliseconds);
        }
    }
    for (std::size_t a = 0; a < contenders.size(); ++a) {
        rows[a].model = model.name;
        rows[a].contender = contenders[a].name;
        rows[a].milliseconds = median(times[a]);
    }
    return rows;
}

const Row& find_contender(const std::vector<Row>& rows, const std::string& contender) {
    return *std::find_if(rows.begin(), rows.end(),
                         [&](const Row& row) { return row.contender == contender; });
}

void measure_surfaces(std::vector<Row>& rows) {
    const Mesh& marrow = find_contender(rows, "Marrow").mesh;
    for (Row& row : rows) {
        row.rough = roughness(row.mesh, kWindow);
        row.smallest_angle = triangle_quality(row.mesh).smallest_angle;
        row.distance = mesh_distance(row.mesh, marrow, {.samples = 50'000});
    }
}

/// A row of Table 1 as printed.
struct Printed {
    const char* model;
    int points_before, points_after;
    double seconds_before, seconds_after;
};
constexpr Printed kPrinted[] = {
    {"Sphenoid", 45440, 38800, 0.345, 0.295},      {"Right-temporal", 39600, 32200, 0.338, 0.277},
    {"Right-maxilla", 38560, 31900, 0.324, 0.268}, {"Ethmoid", 49800, 43800, 0.382, 0.333},
    {"Ankle bone", 63120, 52900, 0.595, 0.500},    {"Teeth", 69760, 59200, 0.467, 0.397},
};

std::string less(double value, double than) {
    return value == than ? "-" : fmt::format("{:.1f} %", 100 * (1 - value / than));
}

constexpr const char* kTable1Head =
    "| model | points: paper, MC | MC + HP | fewer | here, classic | Marrow | fewer | time: paper, MC | MC + "
    "HP | "
    "less | here, classic | Marrow | less |\n"
    "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n";

std::string table_1_line(const std::vector<Row>& rows) {
    const Row& classic = rows.front();
    const Row& marrow = find_contender(rows, "Marrow");
    const Printed& p = *std::find_if(std::begin(kPrinted), std::end(kPrinted),
                                     [&](const Printed& printed) { return classic.model == printed.model; });
    return fmt::format(
        "| {} | {} | {} | {} | {} | {} | {} | {:.3f} s | {:.3f} s | {} | {:.2f} ms | {:.2f} ms | {} |\n",
        p.model, p.points_before, p.points_after, less(p.points_after, p.points_before),
        classic.mesh.points.size(), marrow.mesh.points.size(),
        less(static_cast<double>(marrow.mesh.points.size()), static_cast<double>(classic.mesh.points.size())),
        p.seconds_before, p.seconds_after, less(p.seconds_after, p.seconds_before), classic.milliseconds,
        marrow.milliseconds, less(marrow.milliseconds, classic.milliseconds));
}

constexpr const char* kTableHead =
    "| model | contender | points | fewer points | triangles | ms | less time | times as fast | roughness, "
    "1/mm | "
    "smallest angle | distance to Marrow, mean / max mm |\n"
    "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n";

// Points and times are compared with those of the first contender.
std::string table_lines(const std::vector<Row>& rows) {
    std::string lines;
    const Row& classic = rows.front();
    for (const Row& row : rows) {
        lines +=
            fmt::format("| {} | {} | {} | {} | {} | {:.2f} | {} | {:.1f} | {} | {:.2g} | {:.1g} / {:.1g} |\n",
                        row.model, row.contender, row.mesh.points.size(),
                        less(static_cast<double>(row.mesh.points.size()),
                             static_cast<double>(classic.mesh.points.size())),
                        row.mesh.triangles.size(), row.milliseconds,
                        less(row.milliseconds, classic.milliseconds), classic.milliseconds / row.milliseconds,
                        row.rough.points > 0 ? fmt::format("{:.4f}", row.rough.roughness) : "-",
                        row.smallest_angle, row.distance.mean, row.distance.max);
    }
    return lines;
}

constexpr const char* kSnappingHead =
    "| model | points: Marrow | snapped | fewer | smallest angle: Marrow | snapped | roughness: Marrow | "
    "snapped "
    "| largest distance, mm | time: snapped / Marrow |\n"
    "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n";

std::string snapping_line(const std::vector<Row>& rows) {
    const Row& before = find_contender(rows, "Marrow");
    const Row& after = find_contender(rows, "Marrow, snap 0.3");
    return fmt::format(
        "| {} | {} | {} | {} | {:.2g} | {:.2g} | {:.4f} | {:.4f} | {:.3f} | {:.1f} |\n", before.model,
        before.mesh.points.size(), after.mesh.points.size(),
        less(static_cast<double>(after.mesh.points.size()), static_cast<double>(before.mesh.points.size())),
        before.smallest_angle, after.smallest_angle, before.rough.roughness, after.rough.roughness,
        after.distance.max, after.milliseconds / before.milliseconds);
}

std::string file_name(std::string model) {
    std::transform(model.begin(), model.end(), model.begin(),
                   [](unsigned char c) { return c == ' ' ? '-' : static_cast<char>(std::tolower(c)); });
    return model + ".png";
}

void run(const Settings& settings) {
    fs::create_directories(settings.out);
    std::vector<std::string> notes;
    const std::vector<Model> models = cut_models(settings.data, notes);
    std::string table_1 = kTable1Head, table = kTableHead, snapping = kSnappingHead;
    std::string sources = "| model | cut from | samples | isovalue |\n| --- | --- | --- | --- |\n";
    for (const Model& model : models) {
        std::vector<Row> rows = run_contenders(model, settings.rounds);
        measure_surfaces(rows);
        table_1 += table_1_line(rows);
        table += table_lines(rows);
        snapping += snapping_line(rows);
        const auto& dims = model.volume.geometry().dims;
        sources += fmt::format("| {} | {} | {} x {} x {} | {} HU |\n", model.name, model.source, dims[0],
                               dims[1], dims[2], model.isovalue);
        if (settings.pictures)
            draw_shaded_and_edges(find_contender(rows, "Marrow, normals").mesh, model.view,
                                  settings.out / file_name(model.name));
        fmt::print(stderr, "{}\n", model.name);
    }
    std::string text;
    for (const std::string& note : notes) text += "Note: " + note + ".\n\n";
    text += table_1 + "\n" + table + "\n" + snapping + "\n" + sources;
    fmt::print("{}", text);
    std::ofstream(settings.out / "table.md") << text;
}

}  // namespace
}  // namespace marrow::paper

int main(int argc, char** argv) {
    marrow::paper::Settings settings;
    if (const char* data = std::getenv("MARROW_TEST_DATA")) settings.data = data;
    bool no_pictures = false;
    CLI::App app(
        "Cuts the six models of Visutsak 2020 out of real scans, extracts each with every contender and one\n"
        "thread, and writes Table 1 as OUT/table.md and an image of each model.");
    app.add_option("OUT", settings.out, "output folder")->required();
    app.add_option("--data", settings.data,
                   "folder of vhf_head_ct and vhf_ankle_ct; default: MARROW_TEST_DATA");
    app.add_option("--rounds", settings.rounds, "number of rounds; the results are medians")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_flag("--no-pictures", no_pictures, "write only the table, which needs no display");
    CLI11_PARSE(app, argc, argv);
    settings.pictures = !no_pictures;
    try {
        marrow::paper::run(settings);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-paper: {}\n", error.what());
        return 3;
    }
}
