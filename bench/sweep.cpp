// marrow-bench-sweep: compares sweep_isovalues with one run of Flying Edges per isovalue, in one process.
#include <fmt/core.h>
#include <tbb/global_control.h>
#include <vtkFlyingEdges3D.h>
#include <vtkMassProperties.h>
#include <vtkPolyData.h>
#include <vtkPolyDataConnectivityFilter.h>

#include <CLI/CLI.hpp>

#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/measure.h>
#include <marrow/scan_io.h>

#include "timing.h"
#include "vtk_image.h"

namespace marrow::bench {
namespace {

void run(const std::string& input, double from, double to, int steps, int rounds, int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const Volume scan = read_scan(input);
    std::vector<double> isovalues;
    for (int i = 0; i < steps; ++i) isovalues.push_back(from + (to - from) * i / (steps - 1));
    const auto image = vtk_image(scan);

    const auto flying_edges = [&](bool measures) {
        std::size_t triangles = 0;
        for (const double isovalue : isovalues) {
            vtkNew<vtkFlyingEdges3D> filter;
            filter->SetInputData(image);
            filter->SetValue(0, isovalue);
            filter->Update();
            triangles += static_cast<std::size_t>(filter->GetOutput()->GetNumberOfPolys());
            if (!measures || filter->GetOutput()->GetNumberOfPolys() == 0) continue;
            vtkNew<vtkMassProperties> mass;
            mass->SetInputConnection(filter->GetOutputPort());
            mass->Update();
            vtkNew<vtkPolyDataConnectivityFilter> connectivity;
            connectivity->SetInputConnection(filter->GetOutputPort());
            connectivity->SetExtractionModeToAllRegions();
            connectivity->Update();
        }
        return triangles;
    };
    const Method methods[] = {
        {"marrow sweep",
         [&] {
             std::size_t triangles = 0;
             for (const SweepSample& s : sweep_isovalues(scan, isovalues))
                 triangles += static_cast<std::size_t>(s.triangles);
             return triangles;
         }},
        {"flying edges alone", [&] { return flying_edges(false); }},
        {"flying edges, mass properties, connectivity", [&] { return flying_edges(true); }},
        {"IsosurfaceExtractor and measure()",
         [&] {
             IsosurfaceExtractor extractor(scan, {.normals = false, .closed = true});
             std::size_t triangles = 0;
             for (const double v : isovalues)
                 triangles += static_cast<std::size_t>(marrow::measure(extractor.extract(v)).triangles);
             return triangles;
         }},
    };
    fmt::print("{} isovalues from {:g} to {:g}, {} threads\n", steps, from, to, threads);
    compare(methods, rounds);
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    CLI::App app(
        "Compares Marrow's sweep with one run of Flying Edges per isovalue.\n"
        "ratio: wall and processor time relative to the sweep");
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
