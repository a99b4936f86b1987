// Lists the corners at each point by counting, and walks around the point from corner to corner.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/one_rings.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <vector>

#include "one_rings.h"

#include "base/parallel.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Writes the neighbours in the order of a single closed fan. Returns false if the corners are no such fan.
// Reads kMost corners, even if there are fewer. \pre count <= kMost
template <std::size_t kMost>
HWY_INLINE bool walk_around(std::uint32_t point, const OneRings::Corner* corners, std::size_t count,
                            std::uint32_t* ring) {
    const hn::CappedTag<std::uint32_t, 8> d;
    hn::Vec<decltype(d)> next[kMost], before;
    for (std::size_t i = 0; i < kMost; i += hn::Lanes(d)) {
        hn::LoadInterleaved2(d, &corners[i].next, next[i], before);
        next[i] = hn::IfThenElse(hn::FirstN(d, std::max(i, count) - i), next[i], hn::Set(d, point));
    }
    std::uint32_t at = corners[0].next, visited = 0;
    for (std::size_t n = 0; n < count; ++n) {
        std::uint32_t same = 0;
        for (std::size_t i = 0; i < kMost; i += hn::Lanes(d)) {
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, hn::Eq(next[i], hn::Set(d, at)), bits);
            same |= static_cast<std::uint32_t>(bits[0]) << i;
        }
        // Only one edge may leave the point to this neighbour, and not in a corner that was visited before.
        if (same == 0 || (same & (same - 1)) != 0 || (visited & same) != 0 || at == point) return false;
        visited |= same;
        ring[n] = at;
        at = corners[static_cast<std::size_t>(std::countr_zero(same))].before;
    }
    return count > 1 && at == ring[0];
}

// Writes the rings of the points [begin, end), and whether they are fans. The first corner of the first point
// is corners[0]. Reads some corners more than there are.
void list_rings(const OneRings::Corner* corners, const std::size_t* first, std::size_t begin, std::size_t end,
                std::uint32_t* rings, std::uint8_t* are_fans) {
    for (std::size_t p = begin; p < end; ++p) {
        const std::size_t at = first[p] - first[begin], count = first[p + 1] - first[p];
        const auto point = static_cast<std::uint32_t>(p);
        are_fans[p - begin] = count <= 8 ? walk_around<8>(point, corners + at, count, rings + at)
                              : count <= OneRings::kMostInFan
                                  ? walk_around<OneRings::kMostInFan>(point, corners + at, count, rings + at)
                                  : false;
        if (are_fans[p - begin] != 0) continue;
        for (std::size_t i = at; i < at + count; ++i) rings[i] = corners[i].next;
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(list_rings);

constexpr std::size_t kSection = 8192;  // triangles

// The lowest and the highest point of each section of successive triangles.
std::vector<std::array<std::uint32_t, 2>> reaches_of_sections(std::span<const Triangle> triangles) {
    std::vector<std::array<std::uint32_t, 2>> reaches((triangles.size() + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, reaches.size(), [&](std::size_t s) {
        std::uint32_t lowest = ~std::uint32_t{0}, highest = 0;
        for (std::size_t t = s * kSection; t < std::min((s + 1) * kSection, triangles.size()); ++t) {
            for (const std::uint32_t p : triangles[t]) {
                lowest = std::min(lowest, p);
                highest = std::max(highest, p);
            }
        }
        reaches[s] = {lowest, highest};
    });
    return reaches;
}

// Calls f(t, corner) for the corners at the points [begin, end), from the last triangle to the first.
template <class F>
void for_each_corner_backward(std::span<const Triangle> triangles,
                              const std::vector<std::array<std::uint32_t, 2>>& reaches, std::size_t begin,
                              std::size_t end, const F& f) {
    for (std::size_t s = reaches.size(); s-- > 0;) {
        const auto [lowest, highest] = reaches[s];
        if (highest < begin || lowest >= end) continue;
        const bool all = lowest >= begin && highest < end;
        for (std::size_t t = std::min((s + 1) * kSection, triangles.size()); t-- > s * kSection;) {
            for (std::size_t c = 3; c-- > 0;) {
                if (all || (triangles[t][c] >= begin && triangles[t][c] < end)) f(triangles[t], c);
            }
        }
    }
}

// Whether each edge of a point leaves it once and arrives once. Then each neighbour occurs in one corner as
// the next one, and in one as the one before.
bool are_manifold(std::uint32_t point, std::span<const OneRings::Corner> corners) {
    std::vector<std::uint32_t> next, before;
    for (const OneRings::Corner& c : corners) {
        next.push_back(c.next);
        before.push_back(c.before);
    }
    std::sort(next.begin(), next.end());
    std::sort(before.begin(), before.end());
    return next == before && std::adjacent_find(next.begin(), next.end()) == next.end() &&
           !std::binary_search(next.begin(), next.end(), point);
}

}  // namespace

OneRings::OneRings(const MeshView& mesh)
    : start_(mesh.points.size()),
      count_(mesh.points.size()),
      neighbours_(3 * mesh.triangles.size()),
      listed_(mesh.points.size()),
      kinds_(mesh.points.size()),
      chunks_((mesh.points.size() + kChunk - 1) / kChunk) {
    // Each thread counts and lists the corners at a part of the points.
    const std::span<const Triangle> triangles = mesh.triangles;
    const std::vector<std::array<std::uint32_t, 2>> reaches = reaches_of_sections(triangles);
    const std::size_t points = mesh.points.size();
    const auto parts = static_cast<std::size_t>(thread_count());
    const auto for_each_part = [&](const auto& f) {
        parallel_for(std::size_t{0}, parts,
                     [&](std::size_t i) { f(i, points * i / parts, points * (i + 1) / parts); });
    };
    Buffer<std::size_t> first(points + 1);  // the first corner at each point
    std::vector<std::size_t> before(parts + 1, 0);
    for_each_part([&](std::size_t part, std::size_t begin, std::size_t end) {
        std::fill(first.data() + begin, first.data() + end, std::size_t{0});
        for_each_corner_backward(triangles, reaches, begin, end,
                                 [&](const Triangle& t, std::size_t c) { ++first[t[c]]; });
        before[part + 1] = std::accumulate(first.data() + begin, first.data() + end, std::size_t{0});
    });
    std::partial_sum(before.begin(), before.end(), before.begin());
    Buffer<Corner> corners(neighbours_.size() + OneRings::kMostInFan);
    for_each_part([&](std::size_t part, std::size_t begin, std::size_t end) {
        // Each entry begins as the end of a list, and goes down to its begin.
        std::size_t sum = before[part];
        for (std::size_t p = begin; p < end; ++p) first[p] = sum += first[p];
        for_each_corner_backward(triangles, reaches, begin, end, [&](const Triangle& t, std::size_t c) {
            corners[--first[t[c]]] = {t[(c + 1) % 3], t[(c + 2) % 3]};
        });
    });
    first[points] = neighbours_.size();
    parallel_for(std::size_t{0}, chunks_.size(),
                 [&](std::size_t chunk) { list_chunk(corners.data(), first.data(), chunk); });
}

void OneRings::list_chunk(const Corner* corners, const std::size_t* first, std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, end = std::min(begin + kChunk, size());
    Chunk& c = chunks_[chunk];
    c.reach = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end - 1)};
    std::vector<std::uint32_t> rings(first[end] - first[begin]);
    std::array<std::uint8_t, kChunk> are_fans, list;
    HWY_DYNAMIC_DISPATCH(list_rings)
    (corners + first[begin], first, begin, end, rings.data(), are_fans.data());
    for (const std::uint32_t q : rings) c.reach = {std::min(c.reach[0], q), std::max(c.reach[1], q)};
    std::array<std::uint16_t, kMostInFan + 2> counts{};
    for (std::size_t p = begin; p < end; ++p) {
        const std::size_t count = first[p + 1] - first[p];
        count_[p] = static_cast<std::uint32_t>(count);
        kinds_[p] = are_fans[p - begin] != 0 ? Kind::kFan
                    : are_manifold(static_cast<std::uint32_t>(p), {corners + first[p], count})
                        ? Kind::kRegular
                        : Kind::kIrregular;
        list[p - begin] = static_cast<std::uint8_t>(is_fan(p) ? count : 0);
        ++counts[list[p - begin] + 1u];
    }
    std::partial_sum(counts.begin(), counts.end(), counts.begin());
    c.begin = counts;
    for (std::size_t p = begin; p < end; ++p)
        listed_[begin + counts[list[p - begin]]++] = static_cast<std::uint32_t>(p);
    // The rings go in the order of the lists.
    std::size_t to = first[begin];
    for (std::size_t i = begin; i < end; ++i) {
        const std::size_t p = listed_[i];
        std::copy_n(rings.data() + (first[p] - first[begin]), count_[p], neighbours_.data() + to);
        start_[p] = to;
        to += count_[p];
    }
}

}  // namespace marrow::internal
#endif
