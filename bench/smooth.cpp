// marrow-bench-smooth: compares smooth with vtkWindowedSincPolyDataFilter: 20 steps with the same pass band,
// interleaved.
#include <vtkWindowedSincPolyDataFilter.h>

#include <fmt/core.h>

#include <functional>
#include <string>
#include <vector>

#include <marrow/components.h>
#include <marrow/isosurface.h>
#include <marrow/mesh_check.h>
#include <marrow/smooth.h>

#include "mesh_to_vtk.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

constexpr int kRounds = 5;

struct Contender {
    std::string name;
    std::function<void()> run;
    std::function<Mesh()> result;
    std::vector<double> wall = {}, processor = {};  // seconds
};

void compare_on(const std::string& name, const Mesh& mesh) {
    Mesh smoothed;
    vtkNew<vtkWindowedSincPolyDataFilter> filter;
    filter->SetInputData(to_vtk(mesh));
    filter->SetNumberOfIterations(20);
    filter->SetPassBand(SmoothOptions{}.pass_band);
    filter->BoundarySmoothingOff();
    filter->FeatureEdgeSmoothingOff();
    filter->NormalizeCoordinatesOn();
    const auto smooth_on = [&](int threads) {
        return Contender{threads == 1 ? "marrow, one thread" : "marrow, two threads",
                         [&, threads] { smoothed = smooth(mesh, {.threads = threads}); },
                         [&] { return smoothed; }};
    };
    const auto by_vtk = [&] {
        filter->Modified();
        filter->Update();
    };
    std::vector<Contender> contenders{smooth_on(1), smooth_on(2), {"vtkWindowedSinc", by_vtk, [&] {
                                                                       return from_vtk(filter->GetOutput());
                                                                   }}};
    for (int round = 0; round < kRounds; ++round) {
        for (Contender& c : contenders) {
            const double begin = processor_seconds();
            const auto start = std::chrono::steady_clock::now();
            c.run();
            c.wall.push_back(milliseconds_since(start) / 1000);
            c.processor.push_back(processor_seconds() - begin);
        }
    }
    const double vtk_seconds = median(contenders.back().processor);
    for (const Contender& c : contenders) {
        const MeshCheck check = check_mesh(c.result());
        fmt::print("{:<10} {:<20} {:>9} {:>8.3f} {:>8.3f} {:>6.1f} {:>9} {:>8.2f}\n", name, c.name,
                   mesh.triangles.size(), median(c.wall), median(c.processor),
                   vtk_seconds / median(c.processor), check.self_intersections,
                   100 * (check.measures.volume / measure(mesh).volume - 1));
    }
}

}  // namespace
}  // namespace marrow::bench

int main() {
    using namespace marrow;
    fmt::print("{:<10} {:<20} {:>9} {:>8} {:>8} {:>6} {:>9} {:>8}\n", "surface", "contender", "triangles",
               "wall s", "CPU s", "ratio", "self-int.", "volume %");
    for (const char* name : {"cranium", "vhf-head"}) {
        const auto scan = bench::named_volume(name);
        if (!scan) continue;
        for (const auto& [surface, isovalue] : {std::pair{"skull", 226.0}, std::pair{"skin", -300.0}}) {
            const Mesh mesh = extract_isosurface(scan->volume, isovalue, {.normals = false, .closed = true});
            bench::compare_on(surface, keep_components(mesh, {.count = 1, .cavities = false}));
        }
    }
}
