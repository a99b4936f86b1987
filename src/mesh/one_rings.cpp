// Lists the neighbours by counting, and compares the edges that leave a point with those that arrive.
#include "one_rings.h"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

namespace marrow::internal {

namespace {

// A triangle runs from the corner before a point to the point, and on to the next corner.
struct Corner {
    std::uint32_t next, before;
};

// Whether each edge of a point leaves it once and arrives once. Then each neighbour occurs in one corner as
// the next one, and in one as the one before.
bool are_manifold(std::uint32_t point, const Corner* begin, const Corner* end) {
    for (const Corner* c = begin; c != end; ++c) {
        std::size_t leave = 0, arrive = 0, arrive_from_before = 0;
        for (const Corner* other = begin; other != end; ++other) {
            leave += other->next == c->next;
            arrive += other->before == c->next;
            arrive_from_before += other->before == c->before;
        }
        if (leave != 1 || arrive != 1 || arrive_from_before != 1 || c->next == point) return false;
    }
    return true;
}

}  // namespace

OneRings::OneRings(const MeshView& mesh)
    : start_(mesh.points.size() + 2, 0),
      neighbours_(3 * mesh.triangles.size()),
      regular_(mesh.points.size()) {
    // Counts go two entries further, so that filling leaves the first corner of p in start_[p].
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) ++start_[p + std::size_t{2}];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    Buffer<Corner> corners(neighbours_.size());
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c)
            corners[start_[t[c] + std::size_t{1}]++] = {t[(c + 1) % 3], t[(c + 2) % 3]};
    }
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 4096), [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
            const Corner *begin = corners.data() + start_[p], *end = corners.data() + start_[p + 1];
            regular_[p] = are_manifold(static_cast<std::uint32_t>(p), begin, end);
            std::transform(begin, end, neighbours_.data() + start_[p],
                           [](const Corner& c) { return c.next; });
        }
    });
}

}  // namespace marrow::internal
