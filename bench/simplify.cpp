// marrow-bench-simplify: compares simplify with vtkQuadricDecimation, and with OpenMesh and meshoptimizer
// where they are installed: a tenth of the triangles, interleaved. Conversions between meshes are not timed.
#include <vtkQuadricDecimation.h>

#include <fmt/core.h>

#include <functional>
#include <string>
#include <vector>

#ifdef MARROW_BENCH_OPENMESH
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#endif
#ifdef MARROW_BENCH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
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

#ifdef MARROW_BENCH_OPENMESH
using OpenMeshMesh = OpenMesh::TriMesh_ArrayKernelT<>;

OpenMeshMesh to_openmesh(const Mesh& mesh) {
    OpenMeshMesh result;
    result.reserve(mesh.points.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
    std::vector<OpenMeshMesh::VertexHandle> handles;
    for (const Vec3f& p : mesh.points) handles.push_back(result.add_vertex({p[0], p[1], p[2]}));
    for (const Triangle& t : mesh.triangles) result.add_face(handles[t[0]], handles[t[1]], handles[t[2]]);
    return result;
}

Mesh from_openmesh(const OpenMeshMesh& from) {
    Mesh mesh;
    for (const auto v : from.vertices()) {
        const auto p = from.point(v);
        mesh.points.push_back({p[0], p[1], p[2]});
    }
    for (const auto f : from.faces()) {
        Triangle& t = mesh.triangles.emplace_back();
        std::size_t corner = 0;
        for (const auto v : from.fv_range(f)) t[corner++] = static_cast<std::uint32_t>(v.idx());
    }
    return mesh;
}

Mesh reduce_with_openmesh(const OpenMeshMesh& original, std::int64_t triangles, double& seconds) {
    OpenMeshMesh mesh = original;
    const double start = processor_seconds();
    OpenMesh::Decimater::DecimaterT<OpenMeshMesh> decimater(mesh);
    OpenMesh::Decimater::ModQuadricT<OpenMeshMesh>::Handle quadrics;
    decimater.add(quadrics);
    decimater.module(quadrics).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, static_cast<std::size_t>(triangles));
    mesh.garbage_collection();
    seconds = processor_seconds() - start;
    return from_openmesh(mesh);
}
#endif

#ifdef MARROW_BENCH_MESHOPTIMIZER
Mesh reduce_with_meshoptimizer(const Mesh& mesh, std::int64_t triangles, double& seconds) {
    Mesh result = mesh;
    const double start = processor_seconds();
    const std::size_t indices =
        meshopt_simplify(result.triangles.data()->data(), mesh.triangles.data()->data(),
                         3 * mesh.triangles.size(), mesh.points.data()->data(), mesh.points.size(),
                         sizeof(Vec3f), 3 * static_cast<std::size_t>(triangles), 1);
    seconds = processor_seconds() - start;
    result.triangles.resize(indices / 3);
    return result;
}
#endif

void reduce(const std::string& name, const Mesh& mesh) {
    const auto target = static_cast<std::int64_t>(mesh.triangles.size() / 10);
    const auto vtk_mesh = to_vtk(mesh);
    std::vector<Contender> contenders;
#ifdef MARROW_BENCH_OPENMESH
    const OpenMeshMesh openmesh_mesh = to_openmesh(mesh);
    contenders.push_back({"OpenMesh, quadrics", [&](double& seconds) {
                              return reduce_with_openmesh(openmesh_mesh, target, seconds);
                          }});
#endif
#ifdef MARROW_BENCH_MESHOPTIMIZER
    contenders.push_back(
        {"meshoptimizer", [&](double& seconds) { return reduce_with_meshoptimizer(mesh, target, seconds); }});
#endif
    contenders.push_back({"marrow", [&](double& seconds) {
                              const double start = processor_seconds();
                              Mesh result = simplify(mesh, {.triangles = target, .threads = 1});
                              seconds = processor_seconds() - start;
                              return result;
                          }});
    contenders.push_back({"marrow, measured", [&](double& seconds) {
                              const double start = processor_seconds();
                              SimplifyStats stats;
                              Mesh result = simplify(mesh, {.triangles = target, .threads = 1}, &stats);
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
        fmt::print("{:<12} {:<21} {:>8} {:>8} {:>8.2f} {:>6.1f} {:>6} {:>8} {:>9} {:>8.4f} {:>8.3f}\n", name,
                   contender.name, mesh.triangles.size(), m.triangles, median(contender.seconds),
                   vtk_seconds / median(contender.seconds), m.boundary_edges, m.nonmanifold_edges,
                   check_mesh(contender.result).self_intersections, distance.mean, distance.max);
    }
}

}  // namespace
}  // namespace marrow::bench

int main() {
    using namespace marrow;
#ifndef MARROW_BENCH_OPENMESH
    fmt::print("OpenMesh is not installed (scripts/install-dependencies bench)\n");
#endif
#ifndef MARROW_BENCH_MESHOPTIMIZER
    fmt::print("meshoptimizer is not installed (scripts/install-dependencies bench)\n");
#endif
    fmt::print("{:<12} {:<21} {:>8} {:>8} {:>8} {:>6} {:>6} {:>8} {:>9} {:>8} {:>8}\n", "surface",
               "contender", "from", "to", "CPU s", "ratio", "open", "nonmanif", "intersect", "mean mm",
               "max mm");
    if (const auto scan = bench::cranium()) {
        bench::reduce("skull", extract_isosurface(*scan, 226, {.closed = true}));
        bench::reduce("skin", extract_isosurface(*scan, -300, {.closed = true}));
    }
    const bench::Case phantom = bench::head_phantom(160);
    bench::reduce(phantom.name, extract_isosurface(phantom.volume, phantom.isovalue, {.closed = true}));
}
