// marrow-bench-distance: compares mesh_distance with a search by vtkStaticCellLocator from as
// many positions: the distance between a surface and its reduction, on one thread, interleaved.
// Both build their trees each time.
#include <vtkGenericCell.h>
#include <vtkStaticCellLocator.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/simplify.h>

#include "mesh_to_vtk.h"
#include "timing.h"
#include "volumes.h"

namespace marrow::bench {
namespace {

constexpr int kRounds = 3;
constexpr std::size_t kPositions = 200'000;

// Positions that are spread over the area, by a sequence of low discrepancy.
std::vector<Vec3d> positions_on(const Mesh& mesh) {
    std::vector<double> area{0};  // of all triangles up to each
    const auto corner = [&](const Triangle& t, std::size_t c) { return to_double(mesh.points[t[c]]); };
    for (const Triangle& t : mesh.triangles)
        area.push_back(area.back() +
                       length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))) / 2);
    std::vector<Vec3d> out;
    for (std::size_t k = 0; k < kPositions; ++k) {
        const auto i = static_cast<double>(k);
        const double at = (i + 0.5) / kPositions * area.back();
        const auto next = std::upper_bound(area.begin() + 1, area.end() - 1, at);
        const Triangle& t = mesh.triangles[static_cast<std::size_t>(next - area.begin()) - 1];
        double u = std::fmod(i * 0.7548776662466927, 1), v = std::fmod(i * 0.5698402909980532, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        out.push_back(corner(t, 0) + u * (corner(t, 1) - corner(t, 0)) + v * (corner(t, 2) - corner(t, 0)));
    }
    return out;
}

// From positions on a mesh, and from its points, to another.
MeshDistance one_way(const Mesh& from, const std::vector<Vec3d>& positions, vtkStaticCellLocator* to) {
    vtkNew<vtkGenericCell> cell;
    const auto distance_of = [&](const Vec3d& p) {
        double nearest[3], squared = 0;
        vtkIdType id = 0;
        int part = 0;
        to->FindClosestPoint(p.data(), nearest, cell, id, part, squared);
        return std::sqrt(squared);
    };
    MeshDistance out;
    for (const Vec3d& p : positions) {
        const double distance = distance_of(p);
        out.mean += distance / static_cast<double>(positions.size());
        out.max = std::max(out.max, distance);
    }
    for (const Vec3f& p : from.points) out.max = std::max(out.max, distance_of(to_double(p)));
    return out;
}

struct Surface {
    explicit Surface(const Mesh& given) : mesh(given), vtk(to_vtk(given)), positions(positions_on(given)) {}

    const Mesh& mesh;
    vtkSmartPointer<vtkPolyData> vtk;
    std::vector<Vec3d> positions;
};

MeshDistance distance_by_vtk(const Surface& a, const Surface& b) {
    const auto search = [](const Surface& from, const Surface& to) {
        vtkNew<vtkStaticCellLocator> locator;
        locator->SetDataSet(to.vtk);
        locator->BuildLocator();
        return one_way(from.mesh, from.positions, locator);
    };
    const MeshDistance there = search(a, b), back = search(b, a);
    return {(there.mean + back.mean) / 2, std::max(there.max, back.max)};
}

void compare_on(const std::string& name, const Mesh& mesh) {
    const Mesh reduced =
        simplify(mesh, {.triangles = static_cast<std::int64_t>(mesh.triangles.size() / 10), .threads = 1});
    const Surface whole(mesh), part(reduced);
    std::vector<double> ours, theirs;
    MeshDistance by_marrow, by_vtk;
    for (int round = 0; round < kRounds; ++round) {
        const double begin = processor_seconds();
        by_marrow = mesh_distance(mesh, reduced, {.samples = kPositions, .threads = 1});
        const double middle = processor_seconds();
        by_vtk = distance_by_vtk(whole, part);
        ours.push_back(middle - begin);
        theirs.push_back(processor_seconds() - middle);
    }
    fmt::print("{:<12} {:>8} {:>10.3f} {:>10.3f} {:>6.1f} {:>10.4f} {:>8.4f} {:>10.3f} {:>8.3f}\n", name,
               mesh.triangles.size(), median(ours), median(theirs), median(theirs) / median(ours),
               by_marrow.mean, by_vtk.mean, by_marrow.max, by_vtk.max);
}

}  // namespace
}  // namespace marrow::bench

int main() {
    using namespace marrow;
    fmt::print("{:<12} {:>8} {:>10} {:>10} {:>6} {:>10} {:>8} {:>10} {:>8}\n", "surface", "from", "marrow s",
               "VTK s", "ratio", "mean mm", "VTK", "max mm", "VTK");
    if (const auto scan = bench::named_volume("cranium")) {
        bench::compare_on("skull", extract_isosurface(scan->volume, 226, {.closed = true}));
        bench::compare_on("skin", extract_isosurface(scan->volume, -300, {.closed = true}));
    }
    const bench::Case phantom = bench::head_phantom(160);
    bench::compare_on(phantom.name, extract_isosurface(phantom.volume, phantom.isovalue, {.closed = true}));
}
