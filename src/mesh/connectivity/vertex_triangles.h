/// Lists the triangles at each point of a mesh.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// The triangles at point p are [begin(p), end(p)). Each is rotated so that p is its first corner.
/// \pre indices are in range
class VertexTriangles {
  public:
    explicit VertexTriangles(const MeshView& mesh)
        : start_(mesh.points.size() + 2, 0), triangles_(3 * mesh.triangles.size()) {
        // Counts go two entries further, so that filling leaves the first triangle of p in start_[p].
        for (const Triangle& t : mesh.triangles) {
            for (const std::uint32_t p : t) ++start_[p + std::size_t{2}];
        }
        std::partial_sum(start_.begin(), start_.end(), start_.begin());
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c)
                triangles_[start_[t[c] + std::size_t{1}]++] = {t[c], t[(c + 1) % 3], t[(c + 2) % 3]};
        }
    }
    const Triangle* begin(std::size_t p) const { return triangles_.data() + start_[p]; }
    const Triangle* end(std::size_t p) const { return triangles_.data() + start_[p + 1]; }

  private:
    std::vector<std::size_t> start_;
    std::vector<Triangle> triangles_;
};

/// Whether walking from triangle to triangle around a point visits all its triangles and returns.
inline bool is_closed_fan(const Triangle* begin, const Triangle* end) {
    if (begin == end) return false;
    constexpr std::ptrdiff_t kFew = 16;
    std::vector<Triangle> sorted;  // by the neighbour that each begins with, where there are many
    if (end - begin > kFew) {
        const auto by_first = [](const Triangle& s, const Triangle& t) { return s[1] < t[1]; };
        sorted.assign(begin, end);
        std::sort(sorted.begin(), sorted.end(), by_first);
        begin = sorted.data();
        end = begin + sorted.size();
    }
    const std::uint32_t first = (*begin)[1];
    std::uint32_t at = first;
    for (std::ptrdiff_t left = end - begin; left > 0; --left) {
        const Triangle* const next =
            sorted.empty() ? std::find_if(begin, end, [&](const Triangle& t) { return t[1] == at; })
                           : std::lower_bound(begin, end, at,
                                              [](const Triangle& t, std::uint32_t p) { return t[1] < p; });
        if (next == end || (*next)[1] != at) return false;
        at = (*next)[2];
        if (at == first) return left == 1;
    }
    return false;
}

}  // namespace marrow::internal
