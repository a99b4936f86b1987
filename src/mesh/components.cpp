#include "components.h"

#include <algorithm>
#include <numeric>

namespace marrow::internal {
namespace {

// Union-find over points, with path halving.
std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t p) {
    while (parent[p] != p) p = parent[p] = parent[parent[p]];
    return p;
}

}  // namespace

std::vector<std::uint32_t> lowest_connected_points(const Mesh& mesh) {
    std::vector<std::uint32_t> parent(mesh.points.size());
    std::iota(parent.begin(), parent.end(), 0u);
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 1; c < 3; ++c) {
            const std::uint32_t a = find_root(parent, t[0]), b = find_root(parent, t[c]);
            // The lower index leads, so that chains stay short where points come in the order of space.
            if (a != b) parent[std::max(a, b)] = std::min(a, b);
        }
    }
    // Parents are lower than their children, so one pass upwards flattens all chains.
    for (std::uint32_t& p : parent) p = parent[p];
    return parent;
}

}  // namespace marrow::internal
