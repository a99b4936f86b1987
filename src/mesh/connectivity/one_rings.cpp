// Lists the corners at each point by counting, and walks around the point from corner to corner.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/connectivity/one_rings.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>
#include <vector>

#include "one_rings.h"

#include "base/parallel.h"
#include "point_bands.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Writes the neighbours in the order of a single closed fan. Returns whether the corners are such a fan.
// Reads up to sixteen corners, also beyond those of the point.
template <std::size_t kCount>
HWY_INLINE bool walk_around(std::uint32_t point, const OneRings::Corner* corners, std::uint32_t* ring) {
    constexpr std::size_t kRead = kCount <= 8 ? 8 : 16;
    constexpr std::uint32_t kAll = (1u << kCount) - 1;
    const hn::CappedTag<std::uint32_t, 8> d;
    hn::Vec<decltype(d)> next[kRead], before;
    for (std::size_t i = 0; i < kRead; i += hn::Lanes(d))
        hn::LoadInterleaved2(d, &corners[i].next, next[i], before);
    const auto corners_to = [&](std::uint32_t neighbour) HWY_ATTR {
        std::uint32_t found = 0;
        for (std::size_t i = 0; i < kRead; i += hn::Lanes(d)) {
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, hn::Eq(next[i], hn::Set(d, neighbour)), bits);
            found |= static_cast<std::uint32_t>(bits[0]) << i;
        }
        return found & kAll;
    };
    // The walk takes the first corner to each neighbour. It only comes through all
    // corners if no neighbour has two.
    std::uint32_t at = corners[0].next, visited = 0;
    for (std::size_t n = 0; n < kCount; ++n) {
        const std::uint32_t found = corners_to(at) | 1u << kCount;
        visited |= found & (~found + 1);
        ring[n] = at;
        at = corners[static_cast<std::size_t>(std::countr_zero(found))].before;
    }
    return visited == kAll && at == ring[0] && corners_to(point) == 0;
}

// Writes the rings of points with this number of corners, one after another. Returns whether all are
// fans; the list of others becomes 0.
template <std::size_t kCount>
HWY_INLINE bool write_fans(const OneRings::Corner* corners, const std::size_t* first,
                           std::span<const std::uint32_t> points, std::uint32_t*& rings,
                           std::uint8_t* lists) {
    bool all = true;
    for (const std::uint32_t p : points) {
        if (!walk_around<kCount>(p, corners + first[p % OneRings::kChunk], rings)) {
            lists[p % OneRings::kChunk] = 0;
            all = false;
        }
        rings += kCount;
    }
    return all;
}

template <std::size_t... kCounts>
HWY_INLINE bool write_all_fans(const OneRings::Corner* corners, const std::size_t* first,
                               const std::uint32_t* points,
                               const std::array<std::uint16_t, OneRings::kMostInFan + 2>& begin,
                               std::uint32_t* rings, std::uint8_t* lists, std::index_sequence<kCounts...>) {
    bool all = true;
    ((all &= write_fans<kCounts + 1>(
          corners, first, {points + begin[kCounts + 1], points + begin[kCounts + 2]}, rings, lists)),
     ...);
    return all;
}

// Writes the rings of a chunk's points that may be fans, list by list. Returns whether all are
// fans; the list of others becomes 0.
bool write_rings(const OneRings::Corner* corners, const std::size_t* first, const std::uint32_t* points,
                 const std::array<std::uint16_t, OneRings::kMostInFan + 2>& begin, std::uint32_t* rings,
                 std::uint8_t* lists) {
    return write_all_fans(corners, first, points, begin, rings, lists,
                          std::make_index_sequence<OneRings::kMostInFan>());
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(write_rings);

// Whether each edge of a point leaves it once and arrives once. Then each neighbour occurs in one corner as
// the next one, and in one as the one before.
bool are_manifold(std::uint32_t point, std::span<const OneRings::Corner> corners) {
    // Neighbours that occur as both cancel out. At the border of a surface, two are left.
    std::uint32_t left = 0;
    for (const OneRings::Corner& c : corners) left ^= c.next ^ c.before;
    if (left != 0) return false;
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
    const std::span<const Triangle> triangles = mesh.triangles;
    const PointBands bands(mesh);
    std::vector<std::size_t> start(bands.size() + 1, 0);  // of the rings of each band
    bands.for_each([&](const PointBands::Band& band) {
        std::uint32_t* const begin = count_.data() + band.begin;
        std::fill_n(begin, band.size(), std::uint32_t{0});
        bands.for_each_triangle(band, [&](std::size_t t, const auto& is_inside) {
            for (const std::uint32_t p : triangles[t])
                if (is_inside(p)) ++count_[p];
        });
        start[band.index + 1] = std::accumulate(begin, begin + band.size(), std::size_t{0});
    });
    std::partial_sum(start.begin(), start.end(), start.begin());
    PerThread<Lists> lists_of_thread;
    bands.for_each([&](const PointBands::Band& band) {
        Lists& lists = lists_of_thread.local();
        const std::size_t first_ring = start[band.index];
        lists.corners.resize(std::max(lists.corners.size(), start[band.index + 1] - first_ring + kMostInFan));
        lists.first.resize(bands.width() + 1);
        // Each entry begins as the end of a list, and goes down to its begin.
        std::size_t sum = 0;
        for (std::size_t p = band.begin; p < band.end; ++p) lists.first[p - band.begin] = sum += count_[p];
        lists.first[band.size()] = sum;
        bands.for_each_triangle_backward(band, [&](std::size_t i, const auto& is_inside) {
            const Triangle& t = triangles[i];
            for (std::size_t c = 3; c-- > 0;) {
                if (is_inside(t[c]))
                    lists.corners[--lists.first[t[c] - band.begin]] = {t[(c + 1) % 3], t[(c + 2) % 3]};
            }
        });
        for (std::size_t chunk = band.begin / kChunk; chunk * kChunk < band.end; ++chunk) {
            const std::size_t* const first = &lists.first[chunk * kChunk - band.begin];
            list_chunk(lists.corners.data(), first, first_ring + *first, chunk);
        }
    });
}

void OneRings::list_chunk(const Corner* corners, const std::size_t* first, std::size_t first_ring,
                          std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, end = std::min(begin + kChunk, size());
    Chunk& c = chunks_[chunk];
    // The lists jump to and fro between the corners, which processors do not expect.
    for (std::size_t i = first[0]; i < first[end - begin]; i += 64 / sizeof(Corner))
        hwy::Prefetch(corners + i);
    std::array<std::uint8_t, kChunk> lists;  // the list of each point
    for (std::size_t p = begin; p < end; ++p)
        lists[p - begin] =
            static_cast<std::uint8_t>(count_[p] > 1 && count_[p] <= kMostInFan ? count_[p] : 0);
    std::array<std::uint16_t, kMostInFan + 2> next{};
    for (std::size_t p = begin; p < end; ++p) ++next[lists[p - begin] + 1u];
    std::partial_sum(next.begin(), next.end(), next.begin());
    c.begin = next;
    for (std::size_t p = begin; p < end; ++p)
        listed_[begin + next[lists[p - begin]]++] = static_cast<std::uint32_t>(p);
    // The rings go in the order of the lists, those of fans behind the others.
    std::size_t fans = first_ring;
    for (const std::uint32_t p : listed(chunk, 0)) fans += count_[p];
    if (!HWY_DYNAMIC_DISPATCH(write_rings)(corners, first, listed_.data() + begin, c.begin,
                                           neighbours_.data() + fans, lists.data()))
        move_to_others(chunk, lists, neighbours_.data() + first_ring + first[end - begin] - first[0]);
    std::size_t ring = first_ring;
    for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t p = listed_[i];
        start_[p] = ring;
        ring += count_[p];
        if (lists[p - begin] != 0) {
            kinds_[p] = Kind::kFan;
            continue;
        }
        const std::span<const Corner> at_point(corners + first[p - begin], count_[p]);
        for (std::size_t k = 0; k < at_point.size(); ++k) neighbours_[start_[p] + k] = at_point[k].next;
        kinds_[p] = are_manifold(p, at_point) ? Kind::kRegular : Kind::kIrregular;
    }
    c.reach = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end - 1)};
    extend_reach(c.reach, {neighbours_.data() + first_ring, ring - first_ring});
}

void OneRings::move_to_others(std::size_t chunk, const std::array<std::uint8_t, kChunk>& lists,
                              std::uint32_t* end) {
    std::array<std::uint16_t, kMostInFan + 2>& begin = chunks_[chunk].begin;
    const std::size_t size = begin[kMostInFan + 1];
    std::uint32_t* const points = listed_.data() + chunk * kChunk;
    // The rings of [ring, last) are still to be moved, to where they end at `to`.
    std::uint32_t *ring = end, *last = end, *to = end;
    std::size_t kept = size;
    for (std::size_t i = size, count = kMostInFan; count > 0; --count) {
        while (i > begin[count]) {
            const std::uint32_t p = points[--i];
            ring -= count;
            if (lists[p % kChunk] != 0) {
                points[--kept] = p;
            } else {
                to = std::copy_backward(ring + count, last, to);
                last = ring;
            }
        }
        begin[count] = static_cast<std::uint16_t>(kept);
    }
    std::copy_backward(ring, last, to);
    for (std::size_t i = 0, other = 0; i < size; ++i) {
        if (lists[i] == 0) points[other++] = static_cast<std::uint32_t>(chunk * kChunk + i);
    }
}

}  // namespace marrow::internal
#endif
