// marrow-bench-sweep: sweep_isovalues beside one run of Flying Edges an isovalue, in one process on the same samples.
#include <time.h>

#include <algorithm>
#include <chrono>
#include <functional>

#include <fmt/core.h>
#include <tbb/global_control.h>
#include <vtkFlyingEdges3D.h>
#include <vtkMassProperties.h>
#include <vtkPolyData.h>
#include <vtkPolyDataConnectivityFilter.h>

#include <CLI/CLI.hpp>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>
#include <marrow/sweep.h>

#include "vtk_image.h"

namespace marrow::bench {
namespace {

struct Seconds {
    double wall, processor;
};

Seconds time_of(const std::function<void()>& work) {
    const auto processor = [] {
        timespec t{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    };
    const double begin = processor();
    const auto start = std::chrono::steady_clock::now();
    work();
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
            processor() - begin};
}

Seconds median(std::vector<Seconds> times) {
    const auto middle = [&](double Seconds::*part) {
        std::sort(times.begin(), times.end(), [&](auto& a, auto& b) { return a.*part < b.*part; });
        return times[times.size() / 2].*part;
    };
    return {middle(&Seconds::wall), middle(&Seconds::processor)};
}

void run(const std::string& input, double from, double to, int steps, int rounds, int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const Volume scan = read_scan(input);
    std::vector<double> isovalues;
    for (int i = 0; i < steps; ++i) isovalues.push_back(from + (to - from) * i / (steps - 1));
    const auto image = vtk_image(scan);

    const auto flying_edges = [&](double isovalue, bool measures) {
        vtkNew<vtkFlyingEdges3D> filter;
        filter->SetInputData(image);
        filter->SetValue(0, isovalue);
        filter->Update();
        if (!measures || filter->GetOutput()->GetNumberOfPolys() == 0) return;
        vtkNew<vtkMassProperties> mass;
        mass->SetInputConnection(filter->GetOutputPort());
        mass->Update();
        vtkNew<vtkPolyDataConnectivityFilter> connectivity;
        connectivity->SetInputConnection(filter->GetOutputPort());
        connectivity->SetExtractionModeToAllRegions();
        connectivity->Update();
    };
    struct Arm {
        const char* name;
        std::function<void()> work;
    };
    const Arm arms[] = {
        {"marrow sweep", [&] { sweep_isovalues(scan, isovalues); }},
        {"flying edges alone",
         [&] {
             for (double v : isovalues) flying_edges(v, false);
         }},
        {"flying edges, mass properties, connectivity",
         [&] {
             for (double v : isovalues) flying_edges(v, true);
         }},
        {"marrow's cached extractor and measure()",
         [&] {
             IsosurfaceExtractor extractor(scan, {.normals = false, .closed = true});
             for (double v : isovalues) measure(extractor.extract(v));
         }},
    };
    std::vector<Seconds> times[std::size(arms)];
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t a = 0; a < std::size(arms); ++a) times[a].push_back(time_of(arms[a].work));
    }
    fmt::print("{} isovalues from {:g} to {:g}, {} threads, medians of {} interleaved rounds\n", steps, from,
               to, threads, rounds);
    const Seconds own = median(times[0]);
    for (std::size_t a = 0; a < std::size(arms); ++a) {
        const Seconds s = median(times[a]);
        fmt::print("{:<45} {:8.3f} s  {:8.3f} s of processors  ratio {:6.1f} ({:.1f})\n", arms[a].name,
                   s.wall, s.processor, s.wall / own.wall, s.processor / own.processor);
    }
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    CLI::App app(
        "Times marrow's sweep beside one run of Flying Edges an isovalue. ratio: of the arm's time to the "
        "sweep's, on "
        "the wall and in brackets of processors.");
    std::string input;
    double from = -300, to = 1500;
    int steps = 100, rounds = 3, threads = 1;
    app.add_option("INPUT", input, "a scan")->required();
    app.add_option("--from", from)->capture_default_str();
    app.add_option("--to", to)->capture_default_str();
    app.add_option("-n", steps)->capture_default_str()->check(CLI::Range(2, 100000));
    app.add_option("--rounds", rounds)->capture_default_str()->check(CLI::PositiveNumber);
    app.add_option("--threads", threads)->capture_default_str()->check(CLI::PositiveNumber);
    CLI11_PARSE(app, argc, argv);
    try {
        marrow::bench::run(input, from, to, steps, rounds, threads);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench-sweep: {}\n", error.what());
        return 3;
    }
}
