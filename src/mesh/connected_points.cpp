// Unites the points of each triangle in disjoint sets.
#include "connected_points.h"

#include <numeric>

#include "base/disjoint_sets.h"

namespace marrow::internal {

std::vector<std::uint32_t> lowest_connected_points(const MeshView& mesh) {
    std::vector<std::uint32_t> parents(mesh.points.size());
    std::iota(parents.begin(), parents.end(), 0u);
    for (const Triangle& t : mesh.triangles) {
        unite(parents, t[0], t[1]);
        unite(parents, t[0], t[2]);
    }
    // Parents are lower than their children, so one upward pass makes every parent a representative.
    for (std::uint32_t& p : parents) p = parents[p];
    return parents;
}

}  // namespace marrow::internal
