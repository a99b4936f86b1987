// marrow-bench-simplify: compares simplify with vtkQuadricDecimation: a tenth of the triangles, interleaved.
#include <vtkQuadricDecimation.h>

#include <fmt/core.h>

#include <functional>
#include <string>
#include <vector>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/simplify.h>

#include "mesh_to_vtk.h"
#include "paper/cranium.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

constexpr int kRounds = 3;

struct Contender {
    std::string name;
    std::function<Mesh(double&)> run;  // sets the processor time in seconds
    std::vector<double> seconds = {};
    Mesh result = {};
};

void reduce(const std::string& name, const Mesh& mesh) {
    const auto target = static_cast<std::int64_t>(mesh.triangles.size() / 10);
    const auto vtk_mesh = to_vtk(mesh);
    std::vector<Contender> contenders;
    contenders.push_back({"marrow", [&](double& seconds) {
                              const double start = processor_seconds();
                              Mesh result = simplify(mesh, {.triangles = target});
                              seconds = processor_seconds() - start;
                              return result;
                          }});
    contenders.push_back({"marrow, measured", [&](double& seconds) {
                              const double start = processor_seconds();
                              SimplifyStats stats;
                              Mesh result = simplify(mesh, {.triangles = target}, &stats);
                              seconds = processor_seconds() - start;
                              return result;
                          }});
    contenders.push_back({"vtkQuadricDecimation", [&](double& seconds) {
                              const double start = processor_seconds();
                              vtkNew<vtkQuadricDecimation> filter;
                              filter->SetInputData(vtk_mesh);
                              filter->SetTargetReduction(0.9);
                              filter->Update();
                              seconds = processor_seconds() - start;
                              return from_vtk(filter->GetOutput());
                          }});
    for (int round = 0; round < kRounds; ++round) {
        for (Contender& r : contenders) r.result = r.run(r.seconds.emplace_back());
    }
    const double vtk_seconds = median(contenders.back().seconds);
    for (const Contender& contender : contenders) {
        const MeshMeasures m = measure(contender.result);
        const MeshDistance distance = mesh_distance(mesh, contender.result);
        fmt::print("{:<12} {:<21} {:>8} {:>8} {:>8.2f} {:>6.1f} {:>6} {:>8} {:>8.4f} {:>8.3f}\n", name,
                   contender.name, mesh.triangles.size(), m.triangles, median(contender.seconds),
                   vtk_seconds / median(contender.seconds), m.boundary_edges, m.nonmanifold_edges,
                   distance.mean, distance.max);
    }
}

}  // namespace
}  // namespace marrow::bench

int main() {
    using namespace marrow;
    fmt::print("{:<12} {:<21} {:>8} {:>8} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8}\n", "surface", "contender",
               "from", "to", "CPU s", "ratio", "open", "nonmanif", "mean mm", "max mm");
    if (const auto scan = bench::cranium()) {
        bench::reduce("skull", extract_isosurface(*scan, 226, {.closed = true}));
        bench::reduce("skin", extract_isosurface(*scan, -300, {.closed = true}));
    }
    const bench::Case phantom = bench::head_phantom(160);
    bench::reduce(phantom.name, extract_isosurface(phantom.volume, phantom.isovalue, {.closed = true}));
}
