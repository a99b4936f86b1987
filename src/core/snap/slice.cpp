// The memory of a slice, which is used again for later slices.
#include "slice.h"

#include <algorithm>

namespace marrow::internal {

void SnapSlice::clear(const InsideBits& bits, bool normals_wanted) {
    points.resize(point_count + kSlack);
    offsets.resize(point_count + kSlack);
    normals.resize(normals_wanted ? point_count : 0);
    merged_before.clear();
    if (edges.empty()) {
        rows_in_use.resize(static_cast<std::size_t>(bits.ny));
        stride = bits.words_per_row + 1;
        edges.resize(first_word(bits.ny));
        members.resize(edges.size());
        std::fill(edges.begin(), edges.end(), EdgeBits{});
        std::fill(members.begin(), members.end(), DirectionBits{});
    }
    for (std::size_t y = 0; y < rows_in_use.size(); ++y) {
        if (rows_in_use[y] == 0) continue;
        const std::size_t first = first_word(static_cast<std::int64_t>(y));
        std::fill_n(edges.data() + first, stride, EdgeBits{});
        std::fill_n(members.data() + first, stride, DirectionBits{});
        rows_in_use[y] = 0;
    }
}

std::size_t SnapSlice::bytes() const {
    return points.size() * sizeof points[0] + normals.size() * sizeof normals[0] +
           offsets.size() * sizeof offsets[0] + edges.size() * (sizeof edges[0] + sizeof members[0]);
}

}  // namespace marrow::internal
