// marrow-bench-options: what snapping and exact topology cost, compared with plain extraction, interleaved in
// one process.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "memory.h"
#include "paper/models.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

struct Settings {
    int rounds = 7;
    std::vector<std::string> volumes{"models", "vhf-head", "cranium", "vhf-ankle", "gyroid-256", "noise-64"};
};

const std::array<IsosurfaceOptions, 3> kOptions{
    IsosurfaceOptions{.normals = false, .closed = true, .threads = 1},
    IsosurfaceOptions{.normals = false, .closed = true, .snap = 0.3, .threads = 1},
    IsosurfaceOptions{.normals = false, .closed = true, .topology = true, .threads = 1},
};

// Extracts with every set of options once per round, so that a temporary slowdown of the machine affects them
// all.
void measure(const std::string& name, const VolumeView& volume, double isovalue, int rounds) {
    for (const Memory memory : {Memory::fresh, Memory::retained}) {
        std::array<std::vector<double>, kOptions.size()> times;
        std::size_t triangles = 0;
        for (int round = -1; round < rounds; ++round) {  // the first round is not counted
            for (std::size_t o = 0; o < kOptions.size(); ++o) {
                set_memory(memory);  // again, because the heap may have kept pages of the extraction before
                const double begin = processor_seconds();
                const Mesh mesh = extract_isosurface(volume, isovalue, kOptions[o]);
                if (round >= 0) times[o].push_back(1000 * (processor_seconds() - begin));
                if (o == 0) triangles = mesh.triangles.size();
            }
        }
        const double plain = median(times[0]), snapped = median(times[1]), exact = median(times[2]);
        fmt::print("{:<20} {:<9} {:>10} {:>8.2f} {:>8.2f} {:>6.2f} {:>8.2f} {:>6.2f}\n", name,
                   memory == Memory::fresh ? "fresh" : "retained", triangles, plain, snapped, snapped / plain,
                   exact, exact / plain);
        std::fflush(stdout);
    }
}

void measure_models(int rounds) {
    const char* data = std::getenv("MARROW_TEST_DATA");
    std::vector<std::string> notes;
    const std::vector<paper::Model> models = paper::cut_models(data != nullptr ? data : "", notes);
    for (const std::string& note : notes) fmt::print(stderr, "marrow-bench-options: {}\n", note);
    for (const paper::Model& model : models) measure(model.name, model.volume, model.isovalue, rounds);
}

void run(const Settings& settings) {
    fmt::print("{:<20} {:<9} {:>10} {:>8} {:>8} {:>6} {:>8} {:>6}\n", "surface", "memory", "triangles",
               "plain ms", "snap 0.3", "ratio", "topology", "ratio");
    for (const std::string& name : settings.volumes) {
        if (name == "models") {
            measure_models(settings.rounds);
            continue;
        }
        const std::optional<Case> c = named_volume(name);
        if (!c) {
            fmt::print(stderr, "marrow-bench-options: skipping {}, which is not available\n", name);
            continue;
        }
        const bool is_scan = name == "cranium" || name.starts_with("vhf");
        measure(is_scan ? name + ", bone" : name, c->volume, c->isovalue, settings.rounds);
        if (is_scan) measure(name + ", skin", c->volume, -300, settings.rounds);
    }
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    marrow::bench::Settings settings;
    CLI::App app(
        "Compares extraction with a snap of 0.3, and with exact topology, with extraction without either.\n"
        "All surfaces are closed and have no normals. Times are milliseconds of the processor, with one\n"
        "thread, on new pages and on pages that the heap has kept.");
    app.add_option("--rounds", settings.rounds, "number of rounds; the results are medians")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option(
           "--volumes", settings.volumes,
           "models (those of the paper), cranium (package invesalius-examples), vhf-head or vhf-ankle "
           "(folder MARROW_TEST_DATA), phantom-N, gyroid-N, waves-N-PERIOD, noise-N")
        ->capture_default_str()
        ->delimiter(',');
    CLI11_PARSE(app, argc, argv);
    try {
        marrow::bench::run(settings);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench-options: {}\n", error.what());
        return 3;
    }
}
