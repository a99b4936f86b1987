#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include <marrow/error.h>
#include <marrow/components.h>

#include "check_indices.h"
#include "shells.h"
#include "triangle_tree.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// The part of a mesh in the shells that are kept.
Mesh with_shells(const Mesh& mesh, const Shells& shells, const std::vector<bool>& keep) {
    Mesh result;
    std::vector<std::uint32_t> new_index(mesh.points.size());
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        const std::uint32_t shell = shells.of_point[p];
        if (shell == Shells::kNoShell || !keep[shell]) continue;
        new_index[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(mesh.points[p]);
        if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[p]);
    }
    for (const Triangle& t : mesh.triangles) {
        if (keep[shells.of(t)])
            result.triangles.push_back({new_index[t[0]], new_index[t[1]], new_index[t[2]]});
    }
    return result;
}

// The piece that a cavity lies in: the smallest of those that a ray from it leaves once more than it enters.
std::uint32_t piece_around(const Shell& cavity, const Mesh& mesh, const Shells& shells,
                           const TriangleTree& tree) {
    const Corners corners(mesh, mesh.triangles[cavity.first_triangle]);
    const Vec3d origin = (1.0 / 3) * (corners.a + corners.b + corners.c);
    const Vec3d direction{0.8361, 0.4227, 0.3498};  // along no edge of a grid
    std::map<std::uint32_t, int> crossings;
    tree.for_each_hit(origin, direction, std::numeric_limits<double>::infinity(),
                      [&](double, std::uint32_t t) { ++crossings[shells.of(mesh.triangles[t])]; });
    std::uint32_t smallest = Shells::kNoShell;
    for (const auto& [shell, count] : crossings) {
        const Shell& s = shells.all[shell];
        if (s.is_cavity() || !s.closed || count % 2 == 0) continue;
        if (smallest == Shells::kNoShell || s.volume < shells.all[smallest].volume) smallest = shell;
    }
    return smallest;
}

// The `count` pieces with the most triangles, the first of equals, and the cavities in them.
void keep_largest(std::int64_t count, const Mesh& mesh, const Shells& shells, std::vector<bool>& keep) {
    std::vector<std::uint32_t> pieces, cavities;
    for (std::uint32_t s = 0; s < keep.size(); ++s) {
        if (keep[s]) (shells.all[s].is_cavity() ? cavities : pieces).push_back(s);
    }
    std::stable_sort(pieces.begin(), pieces.end(), [&](std::uint32_t a, std::uint32_t b) {
        return shells.all[a].triangles > shells.all[b].triangles;
    });
    for (std::size_t i = static_cast<std::size_t>(count); i < pieces.size(); ++i) keep[pieces[i]] = false;
    if (cavities.empty()) return;
    const TriangleTree tree(mesh);
    for (const std::uint32_t c : cavities) {
        const std::uint32_t around = piece_around(shells.all[c], mesh, shells, tree);
        keep[c] = around != Shells::kNoShell && keep[around];
    }
}

}  // namespace

Mesh largest_component(const Mesh& mesh) {
    if (mesh.triangles.empty()) return {};
    const Shells shells = find_shells(mesh);
    const auto largest =
        std::max_element(shells.all.begin(), shells.all.end(),
                         [](const Shell& a, const Shell& b) { return a.triangles < b.triangles; });
    std::vector<bool> keep(shells.all.size(), false);
    keep[static_cast<std::size_t>(largest - shells.all.begin())] = true;
    return with_shells(mesh, shells, keep);
}

Mesh keep_components(const Mesh& mesh, const ComponentOptions& options) {
    if (options.count < 0) throw InputError("components: the count must not be negative");
    if (!(options.min_volume >= 0)) throw InputError("components: the smallest volume must be 0 or more");
    check_triangles(mesh);
    const Shells shells = find_shells(mesh);
    std::vector<bool> keep;
    for (const Shell& shell : shells.all) {
        const bool too_small = shell.closed && std::abs(shell.volume) < options.min_volume;
        keep.push_back(!too_small && (options.cavities || !shell.is_cavity()));
    }
    if (options.count > 0) keep_largest(options.count, mesh, shells, keep);
    return with_shells(mesh, shells, keep);
}

}  // namespace marrow
