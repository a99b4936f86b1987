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
    std::function<Mesh(double&)> run;  // sets the seconds that it took
    std::vector<double> seconds = {};
    Mesh result = {};
};

Mesh smooth_timed(const Mesh& mesh, int threads, double& seconds) {
    const auto start = std::chrono::steady_clock::now();
    Mesh result = smooth(mesh, {.threads = threads});
    seconds = milliseconds_since(start) / 1000;
    return result;
}

Mesh smooth_by_vtk(vtkPolyData* mesh, double& seconds) {
    const auto start = std::chrono::steady_clock::now();
    vtkNew<vtkWindowedSincPolyDataFilter> filter;
    filter->SetInputData(mesh);
    filter->SetNumberOfIterations(20);
    filter->SetPassBand(SmoothOptions{}.pass_band);
    filter->BoundarySmoothingOff();
    filter->FeatureEdgeSmoothingOff();
    filter->NormalizeCoordinatesOn();
    filter->Update();
    seconds = milliseconds_since(start) / 1000;
    return from_vtk(filter->GetOutput());
}

void compare_on(const std::string& name, const Mesh& mesh) {
    const auto vtk_mesh = to_vtk(mesh);
    std::vector<Contender> contenders{
        {"marrow, one thread", [&](double& seconds) { return smooth_timed(mesh, 1, seconds); }},
        {"marrow, two threads", [&](double& seconds) { return smooth_timed(mesh, 2, seconds); }},
        {"vtkWindowedSinc", [&](double& seconds) { return smooth_by_vtk(vtk_mesh, seconds); }}};
    for (int round = 0; round < kRounds; ++round) {
        for (Contender& c : contenders) c.result = c.run(c.seconds.emplace_back());
    }
    const double vtk_seconds = median(contenders.back().seconds);
    for (const Contender& c : contenders) {
        const MeshCheck check = check_mesh(c.result);
        fmt::print("{:<10} {:<20} {:>9} {:>8.3f} {:>6.1f} {:>9} {:>8.2f}\n", name, c.name,
                   mesh.triangles.size(), median(c.seconds), vtk_seconds / median(c.seconds),
                   check.self_intersections, 100 * (check.measures.volume / measure(mesh).volume - 1));
    }
}

}  // namespace
}  // namespace marrow::bench

int main() {
    using namespace marrow;
    fmt::print("{:<10} {:<20} {:>9} {:>8} {:>6} {:>9} {:>8}\n", "surface", "contender", "triangles", "s",
               "ratio", "self-int.", "volume %");
    for (const char* name : {"cranium", "vhf-head"}) {
        const auto scan = bench::named_volume(name);
        if (!scan) continue;
        for (const auto& [surface, isovalue] : {std::pair{"skull", 226.0}, std::pair{"skin", -300.0}}) {
            const Mesh mesh = extract_isosurface(scan->volume, isovalue, {.normals = false, .closed = true});
            bench::compare_on(surface, keep_components(mesh, {.count = 1, .cavities = false}));
        }
    }
}
