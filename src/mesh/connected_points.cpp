// Gives connected points the same label wherever this is easy, and unites what is left in disjoint sets.
#include "connected_points.h"

#include <algorithm>
#include <numeric>

#include "base/disjoint_sets.h"

namespace marrow::internal {

namespace {

// Parents are lower than their children, so one upward pass makes every parent a representative.
void flatten(std::vector<std::uint32_t>& parents) {
    for (std::uint32_t& p : parents) p = parents[p];
}

}  // namespace

std::vector<std::uint32_t> lowest_connected_points(const MeshView& mesh) {
    std::vector<std::uint32_t> parents(mesh.points.size());
    std::iota(parents.begin(), parents.end(), 0u);
    // Without branches. This forgets that some points are connected, but of neighbouring triangles only few.
    for (const auto& [a, b, c] : mesh.triangles) {
        const std::uint32_t old[3] = {parents[a], parents[b], parents[c]};
        const std::uint32_t lowest = std::min({old[0], old[1], old[2]});
        for (const std::uint32_t p : {old[0], old[1], old[2], a, b, c}) parents[p] = lowest;
    }
    flatten(parents);
    for (const auto& [a, b, c] : mesh.triangles) {
        if (parents[a] == parents[b] && parents[a] == parents[c]) continue;
        unite(parents, a, b);
        unite(parents, a, c);
    }
    flatten(parents);
    return parents;
}

}  // namespace marrow::internal
