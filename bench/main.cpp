// marrow-bench: Marrow and its rivals on the same buffers, interleaved, in one process.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include <tbb/global_control.h>

#include <marrow/error.h>

#include "arms.h"
#include "bandwidth.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

struct Settings {
    bool json = false;
    int rounds = 7;
    std::vector<std::string> volumes{"phantom-256", "phantom-512", "gyroid-256"};
    std::vector<std::string> arms;
    std::vector<int> threads;
    std::string raw, type = "int16";
    std::array<std::int64_t, 3> dims{0, 0, 0};
    double isovalue = 226;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

struct Row {
    std::string volume, arm, memory;
    int threads;
    Result result;  // with the median time
    double ratio_to_flying_edges, limit_fraction;
};

// Every arm once a round, so that whatever slows the machine for a while slows them all.
std::vector<Row> measure_case(const Case& c, const Settings& settings, int threads,
                              const Bandwidth& bandwidth) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    std::vector<Row> rows;
    for (const Memory memory : {Memory::fresh, Memory::retained}) {
        set_memory(memory);
        std::vector<Arm> arms = make_arms(c.volume, c.isovalue, threads);
        if (!settings.arms.empty()) {
            std::erase_if(arms, [&](const Arm& a) {
                return std::find(settings.arms.begin(), settings.arms.end(), a.name) == settings.arms.end();
            });
        }
        std::vector<std::vector<double>> times(arms.size());
        std::vector<Result> results(arms.size());
        for (int round = -1; round < settings.rounds; ++round) {  // the first is not counted
            for (std::size_t a = 0; a < arms.size(); ++a) {
                results[a] = arms[a].run();
                if (round >= 0) times[a].push_back(results[a].milliseconds);
            }
        }
        double flying_edges = 0;
        for (std::size_t a = 0; a < arms.size(); ++a) {
            if (arms[a].name == "flying-edges") flying_edges = median(times[a]);
        }
        for (std::size_t a = 0; a < arms.size(); ++a) {
            Result& r = results[a];
            r.milliseconds = median(times[a]);
            const double limit_ms =
                1000 * (static_cast<double>(c.volume.bytes()) / bandwidth.read_bytes_per_second +
                        static_cast<double>(r.output_bytes) / bandwidth.write_bytes_per_second);
            rows.push_back({c.name, arms[a].name, memory == Memory::fresh ? "fresh" : "retained", threads, r,
                            flying_edges / r.milliseconds, limit_ms / r.milliseconds});
        }
    }
    return rows;
}

nlohmann::json to_json(const std::vector<Row>& rows) {
    auto array = nlohmann::json::array();
    for (const Row& r : rows) {
        array.push_back(
            {{"volume", r.volume},
             {"arm", r.arm},
             {"threads", r.threads},
             {"memory", r.memory},
             {"ms", r.result.milliseconds},
             {"ratio_to_flying_edges", r.ratio_to_flying_edges},
             {"limit_fraction", r.limit_fraction},
             {"points", r.result.points},
             {"triangles", r.result.triangles},
             {"scratch_bytes",
              r.result.scratch_bytes < 0 ? nlohmann::json() : nlohmann::json(r.result.scratch_bytes)}});
    }
    return array;
}

void print(const std::vector<Row>& rows, const Case& c) {
    for (const Row& r : rows) {
        const double seconds = r.result.milliseconds / 1000;
        fmt::print("{:<12} {:<24} {:>2} {:<9} {:>9.1f} {:>7.2f} {:>9.0f} {:>8.1f} {:>6.2f} {:>9}\n", r.volume,
                   r.arm, r.threads, r.memory, r.result.milliseconds, r.ratio_to_flying_edges,
                   static_cast<double>(c.volume.geometry().sample_count()) / seconds / 1e6,
                   static_cast<double>(r.result.triangles) / seconds / 1e6, r.limit_fraction,
                   r.result.scratch_bytes < 0
                       ? "-"
                       : fmt::format("{:.1f} %", 100.0 * static_cast<double>(r.result.scratch_bytes) /
                                                     static_cast<double>(c.volume.bytes())));
    }
    std::fflush(stdout);
}

Case make_case(const std::string& name) {
    const auto dash = name.find('-');
    if (dash != std::string::npos) {
        const std::int64_t n = std::atoll(name.c_str() + dash + 1);
        if (n >= 2 && name.substr(0, dash) == "phantom") return head_phantom(n);
        if (n >= 2 && name.substr(0, dash) == "gyroid") return gyroid(n);
    }
    throw InputError("unknown volume '" + name + "'; use phantom-N or gyroid-N");
}

int run(const Settings& settings) {
    std::vector<Row> all;
    if (!settings.json) {
        fmt::print("{:<12} {:<24} {:>2} {:<9} {:>9} {:>7} {:>9} {:>8} {:>6} {:>9}\n", "volume", "arm", "th",
                   "memory", "ms", "ratio", "Mvoxel/s", "Mtri/s", "limit", "scratch");
    }
    std::vector<int> thread_counts = settings.threads;
    if (thread_counts.empty()) {
        thread_counts = {1};
        if (std::thread::hardware_concurrency() > 1)
            thread_counts.push_back(static_cast<int>(std::thread::hardware_concurrency()));
    }
    const auto measure = [&](const Case& c) {
        for (const int threads : thread_counts) {
            const std::vector<Row> rows = measure_case(c, settings, threads, measure_bandwidth(threads));
            if (!settings.json) print(rows, c);
            all.insert(all.end(), rows.begin(), rows.end());
        }
    };
    if (settings.raw.empty()) {
        for (const std::string& name : settings.volumes) measure(make_case(name));
    } else {
        measure(raw_volume(settings.raw, settings.dims, settings.type, settings.isovalue));
    }
    if (settings.json) fmt::print("{}\n", to_json(all).dump(1));
    return 0;
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    marrow::bench::Settings settings;
    CLI::App app(
        "Times Marrow beside vtkFlyingEdges3D, vtkMarchingCubes and the classic algorithm.\n"
        "ratio: Flying Edges' time over the arm's; limit: time to read the volume and write the output once "
        "at the\n"
        "machine's bandwidth, over the arm's; scratch: memory beside volume and output, of the volume.");
    app.add_flag("--json", settings.json, "an array of objects instead of a table");
    app.add_option("--rounds", settings.rounds, "counted rounds; medians are shown")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--volumes", settings.volumes, "phantom-N, gyroid-N")
        ->capture_default_str()
        ->delimiter(',');
    app.add_option("--arms", settings.arms, "only these arms")->delimiter(',');
    app.add_option("--threads", settings.threads, "thread counts; default: 1 and all")->delimiter(',');
    auto* raw = app.add_option("--raw", settings.raw, "a raw volume instead: little-endian, x fastest")
                    ->check(CLI::ExistingFile);
    app.add_option("--dims", settings.dims, "its size X,Y,Z")->delimiter(',')->needs(raw);
    app.add_option("--type", settings.type, "its sample type")->capture_default_str()->needs(raw);
    app.add_option("--isovalue", settings.isovalue, "its isovalue")->capture_default_str()->needs(raw);
    CLI11_PARSE(app, argc, argv);
    try {
        return marrow::bench::run(settings);
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench: {}\n", error.what());
        return 3;
    }
}
