/// Checks of meshes that do not use the code under test.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::test {

/// Describes a fault of the mesh, or returns "" if it is a closed manifold: every edge has exactly two
/// triangles with opposite orientation, the triangles around every point form one cycle, no triangle repeats
/// an index or another triangle, and every point is used. With `open`, edges may have one triangle, and the
/// points on them need no cycle.
inline std::string manifold_fault(const Mesh& mesh, bool open = false) {
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> directed;
    directed.reserve(3 * mesh.triangles.size());
    std::vector<std::vector<Edge>> links(mesh.points.size());
    std::vector<Triangle> sorted_triangles;
    sorted_triangles.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) {
            if (t[c] >= mesh.points.size()) return "index beyond the points";
            if (t[c] == t[(c + 1) % 3]) return "triangle repeats an index";
            directed.push_back({t[c], t[(c + 1) % 3]});
            links[t[c]].push_back({t[(c + 1) % 3], t[(c + 2) % 3]});
        }
        Triangle s = t;
        std::sort(s.begin(), s.end());
        sorted_triangles.push_back(s);
    }
    std::sort(sorted_triangles.begin(), sorted_triangles.end());
    if (std::adjacent_find(sorted_triangles.begin(), sorted_triangles.end()) != sorted_triangles.end()) {
        return "duplicate triangle";
    }
    std::sort(directed.begin(), directed.end());
    if (std::adjacent_find(directed.begin(), directed.end()) != directed.end())
        return "edge used twice in one direction";
    std::vector<bool> on_border(mesh.points.size(), false);
    for (const auto& [a, b] : directed) {
        if (std::binary_search(directed.begin(), directed.end(), Edge{b, a})) continue;
        if (!open) return "open edge";
        on_border[a] = on_border[b] = true;
    }
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        const auto& link = links[p];
        if (link.empty()) return "point without a triangle";
        if (on_border[p]) continue;
        std::size_t steps = 0;
        std::uint32_t at = link.front().first;
        do {
            const auto next =
                std::find_if(link.begin(), link.end(), [&](const Edge& e) { return e.first == at; });
            if (next == link.end()) return "point whose triangles do not close";
            at = next->second;
            ++steps;
        } while (at != link.front().first && steps <= link.size());
        if (steps != link.size()) return "point where two sheets meet";
    }
    return {};
}

using PointBits = std::array<std::uint32_t, 3>;

inline PointBits bits_of(const Vec3f& p) {
    PointBits bits;
    for (std::size_t r = 0; r < 3; ++r) {
        const float value = p[r] == 0 ? 0.0f : p[r];  // -0 is 0
        std::memcpy(&bits[r], &value, sizeof value);
    }
    return bits;
}

/// The triangles as positions, in a normal form: each begins with its smallest corner, and they are sorted.
/// Equal for equal surfaces.
inline std::vector<std::array<PointBits, 3>> triangle_positions(const Mesh& mesh) {
    std::vector<std::array<PointBits, 3>> result;
    result.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        std::array<PointBits, 3> corners{bits_of(mesh.points[t[0]]), bits_of(mesh.points[t[1]]),
                                         bits_of(mesh.points[t[2]])};
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        result.push_back(corners);
    }
    std::sort(result.begin(), result.end());
    return result;
}

/// A hash of every byte of a mesh (FNV-1a).
inline std::uint64_t mesh_hash(const Mesh& mesh) {
    std::uint64_t hash = 1469598103934665603u;
    const auto add = [&](const void* data, std::size_t bytes) {
        for (std::size_t i = 0; i < bytes; ++i)
            hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211u;
    };
    add(mesh.points.data(), mesh.points.size() * sizeof(Vec3f));
    add(mesh.normals.data(), mesh.normals.size() * sizeof(Vec3f));
    add(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
    return hash;
}

}  // namespace marrow::test
