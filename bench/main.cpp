// marrow-bench: times Marrow and other extractors on the same buffers, interleaved, in one process.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include <tbb/global_control.h>

#include <marrow/error.h>

#include "bandwidth.h"
#include "contenders.h"
#include "memory.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

struct Settings {
    bool json = false;
    int rounds = 7;
    std::vector<std::string> volumes{"phantom-256", "phantom-512", "gyroid-256", "cranium", "vhf-head"};
    std::vector<std::string> contenders;
    std::vector<int> threads;
    std::string save;
    std::string raw, type = "int16";
    std::array<std::int64_t, 3> dims{0, 0, 0};
    double isovalue = 226;
};

struct Row {
    std::string volume;
    std::int64_t samples, active_cells;
    std::string contender, memory;
    int threads;
    Result result;  // with the median duration
    double ratio_to_flying_edges, limit_fraction;
};

// Runs every contender once per round, so that a temporary slowdown of the machine affects them all. The
// order rotates, because a contender can affect the next one, for instance by the memory that it returns to
// the system.
std::vector<Row> measure_case(const Case& c, const Settings& settings, int threads,
                              const Bandwidth& bandwidth) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const std::int64_t active = active_cells(c);
    std::vector<Row> rows;
    for (const Memory memory : {Memory::fresh, Memory::retained}) {
        set_memory(memory);
        std::vector<Contender> contenders = make_contenders(c.volume, c.isovalue, threads);
        if (!settings.contenders.empty()) {
            std::erase_if(contenders, [&](const Contender& a) {
                return std::find(settings.contenders.begin(), settings.contenders.end(), a.name) ==
                       settings.contenders.end();
            });
        }
        std::vector<std::vector<double>> times(contenders.size());
        std::vector<Result> results(contenders.size());
        for (int round = -1; round < settings.rounds; ++round) {  // the first round is not counted
            for (std::size_t turn = 0; turn < contenders.size(); ++turn) {
                const std::size_t a = (turn + static_cast<std::size_t>(round + 1)) % contenders.size();
                set_memory(memory);  // again, because the heap may have kept pages of the contender before
                results[a] = contenders[a].run();
                if (round >= 0) times[a].push_back(results[a].milliseconds);
            }
        }
        double flying_edges = 0;
        for (std::size_t a = 0; a < contenders.size(); ++a) {
            if (contenders[a].name == "flying-edges") flying_edges = median(times[a]);
        }
        for (std::size_t a = 0; a < contenders.size(); ++a) {
            Result& r = results[a];
            r.milliseconds = median(times[a]);
            const double limit_ms =
                1000 * (static_cast<double>(c.volume.bytes()) / bandwidth.read_bytes_per_second +
                        static_cast<double>(r.output_bytes) / bandwidth.write_bytes_per_second);
            rows.push_back({c.name, c.volume.geometry().sample_count(), active, contenders[a].name,
                            memory == Memory::fresh ? "fresh" : "retained", threads, r,
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
             {"samples", r.samples},
             {"active_cells", r.active_cells},
             {"contender", r.contender},
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
                   r.contender, r.threads, r.memory, r.result.milliseconds, r.ratio_to_flying_edges,
                   static_cast<double>(r.samples) / seconds / 1e6,
                   static_cast<double>(r.result.triangles) / seconds / 1e6, r.limit_fraction,
                   r.result.scratch_bytes < 0
                       ? "-"
                       : fmt::format("{:.1f} %", 100.0 * static_cast<double>(r.result.scratch_bytes) /
                                                     static_cast<double>(c.volume.bytes())));
    }
    std::fflush(stdout);
}

template <class Work>
void for_each_volume(const Settings& settings, const Work& work) {
    if (settings.raw.empty()) {
        for (const std::string& name : settings.volumes) {
            if (const std::optional<Case> c = named_volume(name))
                work(*c);
            else
                fmt::print(stderr, "marrow-bench: skipping {}, which is not available\n", name);
        }
    } else {
        work(raw_volume(settings.raw, settings.dims, settings.type, settings.isovalue));
    }
}

// Writes the volumes and their description for other programs.
void save_volumes(const Settings& settings) {
    std::filesystem::create_directories(settings.save);
    auto array = nlohmann::json::array();
    for_each_volume(settings, [&](const Case& c) {
        const auto file = std::filesystem::path(settings.save) / (c.name + ".raw");
        std::ofstream out(file, std::ios::binary);
        out.write(static_cast<const char*>(c.volume.data()), static_cast<std::streamsize>(c.volume.bytes()));
        if (!out.flush()) throw IoError(file.string() + ": cannot write this file");
        array.push_back({{"volume", c.name},
                         {"file", file.string()},
                         {"dims", c.volume.geometry().dims},
                         {"type", sample_type_name(c.volume.type())},
                         {"isovalue", c.isovalue}});
    });
    fmt::print("{}\n", array.dump(1));
}

void time_contenders(const Settings& settings) {
    std::vector<Row> all;
    if (!settings.json) {
        fmt::print("{:<12} {:<24} {:>2} {:<9} {:>9} {:>7} {:>9} {:>8} {:>6} {:>9}\n", "volume", "contender",
                   "th", "memory", "ms", "ratio", "Mvoxel/s", "Mtri/s", "limit", "scratch");
    }
    std::vector<int> thread_counts = settings.threads;
    if (thread_counts.empty()) {
        thread_counts = {1};
        if (std::thread::hardware_concurrency() > 1)
            thread_counts.push_back(static_cast<int>(std::thread::hardware_concurrency()));
    }
    for_each_volume(settings, [&](const Case& c) {
        for (const int threads : thread_counts) {
            const std::vector<Row> rows = measure_case(c, settings, threads, measure_bandwidth(threads));
            if (!settings.json) print(rows, c);
            all.insert(all.end(), rows.begin(), rows.end());
        }
    });
    if (settings.json) fmt::print("{}\n", to_json(all).dump(1));
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    marrow::bench::Settings settings;
    CLI::App app(
        "Compares Marrow with vtkFlyingEdges3D, vtkMarchingCubes and the classic algorithm.\n"
        "ratio: the time of Flying Edges divided by that of the contender\n"
        "limit: the time to read the volume and write the output once, divided by the time of the contender\n"
        "scratch: memory in addition to volume and output, relative to the volume");
    app.add_flag("--json", settings.json, "print an array of JSON objects instead of a table");
    app.add_option(
        "--save", settings.save,
        "instead of timing, write the volumes to this folder as raw files and describe them as JSON");
    app.add_option("--rounds", settings.rounds, "number of rounds; the results are medians")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--volumes", settings.volumes,
                   "phantom-N, gyroid-N, waves-N-PERIOD, noise-N, cranium (package invesalius-examples), "
                   "vhf-head or vhf-ankle (folder MARROW_TEST_DATA)")
        ->capture_default_str()
        ->delimiter(',');
    app.add_option("--contenders", settings.contenders, "run only these contenders")->delimiter(',');
    app.add_option("--threads", settings.threads, "numbers of threads; default: 1 and all")->delimiter(',');
    auto* raw = app.add_option("--raw", settings.raw, "a raw volume instead, little-endian, x fastest")
                    ->check(CLI::ExistingFile);
    app.add_option("--dims", settings.dims, "size X,Y,Z of the raw volume")->delimiter(',')->needs(raw);
    app.add_option("--type", settings.type, "sample type of the raw volume")
        ->capture_default_str()
        ->needs(raw);
    app.add_option("--isovalue", settings.isovalue, "isovalue of the raw volume")
        ->capture_default_str()
        ->needs(raw);
    CLI11_PARSE(app, argc, argv);
    try {
        settings.save.empty() ? marrow::bench::time_contenders(settings)
                              : marrow::bench::save_volumes(settings);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench: {}\n", error.what());
        return 3;
    }
}
