#include <algorithm>
#include <vector>

#include <marrow/refine.h>

#include "components.h"

namespace marrow {

Mesh largest_component(const Mesh& mesh) {
    if (mesh.triangles.empty()) return {};
    const std::vector<std::uint32_t> component = internal::lowest_connected_points(mesh);
    std::vector<std::uint64_t> triangles_in(mesh.points.size(), 0);
    for (const Triangle& t : mesh.triangles) ++triangles_in[component[t[0]]];
    const auto largest = static_cast<std::uint32_t>(
        std::max_element(triangles_in.begin(), triangles_in.end()) - triangles_in.begin());

    Mesh result;
    std::vector<std::uint32_t> new_index(mesh.points.size());
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        if (component[p] != largest) continue;
        new_index[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(mesh.points[p]);
        if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[p]);
    }
    for (const Triangle& t : mesh.triangles) {
        if (component[t[0]] == largest)
            result.triangles.push_back({new_index[t[0]], new_index[t[1]], new_index[t[2]]});
    }
    return result;
}

}  // namespace marrow
