/// The triangles round each point of a mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// Those of point p are at [begin(p), end(p)), each turned so that p comes first. \pre triangles name points
/// that are there
struct Fans {
    std::vector<std::size_t> start;
    std::vector<Triangle> triangles;

    explicit Fans(const Mesh& mesh) : start(mesh.points.size() + 2, 0), triangles(3 * mesh.triangles.size()) {
        // Counted two slots on, so that filling leaves start[p] at the begin of p's triangles.
        for (const Triangle& t : mesh.triangles) {
            for (std::uint32_t p : t) ++start[p + std::size_t{2}];
        }
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c)
                triangles[start[t[c] + std::size_t{1}]++] = {t[c], t[(c + 1) % 3], t[(c + 2) % 3]};
        }
    }
    const Triangle* begin(std::size_t p) const { return triangles.data() + start[p]; }
    const Triangle* end(std::size_t p) const { return triangles.data() + start[p + 1]; }
};

}  // namespace marrow::internal
