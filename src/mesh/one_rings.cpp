// Lists the corners at each point by counting, and walks around the point from corner to corner.
#include "one_rings.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace marrow::internal {

// A triangle runs from the corner before a point to the point, and on to the next corner.
struct OneRings::Corner {
    std::uint32_t next, before;
};

namespace {

constexpr std::size_t kSection = 8192;  // triangles

// The lowest and the highest point of each section of successive triangles.
std::vector<std::array<std::uint32_t, 2>> reaches_of_sections(std::span<const Triangle> triangles) {
    std::vector<std::array<std::uint32_t, 2>> reaches((triangles.size() + kSection - 1) / kSection);
    tbb::parallel_for(std::size_t{0}, reaches.size(), [&](std::size_t s) {
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
template <class Corner>
bool are_manifold(std::uint32_t point, std::span<const Corner> corners) {
    for (const Corner& c : corners) {
        std::size_t leave = 0, arrive = 0, arrive_from_before = 0;
        for (const Corner& other : corners) {
            leave += other.next == c.next;
            arrive += other.before == c.next;
            arrive_from_before += other.before == c.before;
        }
        if (leave != 1 || arrive != 1 || arrive_from_before != 1 || c.next == point) return false;
    }
    return true;
}

// Writes the neighbours in the order of a single closed fan. Returns false if the corners are no such fan.
template <class Corner>
bool walk_around(std::uint32_t point, std::span<const Corner> corners, std::uint32_t* ring) {
    constexpr std::size_t kMost = 16;
    const std::size_t count = corners.size();
    if (count < 2 || count > kMost) return false;
    std::array<std::uint32_t, kMost> next;
    const std::size_t padded = count <= 8 ? 8 : kMost;
    for (std::size_t i = 0; i < padded; ++i) next[i] = i < count ? corners[i].next : point;
    std::uint32_t at = corners[0].next, visited = 0;
    for (std::size_t n = 0; n < count; ++n) {
        std::uint32_t same = 0;
        for (std::size_t i = 0; i < padded; ++i) same |= static_cast<std::uint32_t>(next[i] == at) << i;
        // The edge to the neighbour leaves the point once, in a corner that is not visited yet.
        if (!std::has_single_bit(same) || (visited & same) != 0 || at == point) return false;
        visited |= same;
        ring[n] = at;
        at = corners[static_cast<std::size_t>(std::countr_zero(same))].before;
    }
    return at == ring[0];
}

}  // namespace

OneRings::OneRings(const MeshView& mesh)
    : start_(mesh.points.size() + 1),
      neighbours_(3 * mesh.triangles.size()),
      listed_(mesh.points.size()),
      kinds_(mesh.points.size()),
      chunks_((mesh.points.size() + kChunk - 1) / kChunk) {
    // Each thread counts and lists the corners at a part of the points.
    const std::span<const Triangle> triangles = mesh.triangles;
    const std::vector<std::array<std::uint32_t, 2>> reaches = reaches_of_sections(triangles);
    const std::size_t points = mesh.points.size();
    const auto parts = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
    const auto for_each_part = [&](const auto& f) {
        tbb::parallel_for(std::size_t{0}, parts,
                          [&](std::size_t i) { f(i, points * i / parts, points * (i + 1) / parts); });
    };
    std::vector<std::size_t> before(parts + 1, 0);
    for_each_part([&](std::size_t part, std::size_t begin, std::size_t end) {
        std::fill(start_.data() + begin, start_.data() + end, std::size_t{0});
        for_each_corner_backward(triangles, reaches, begin, end,
                                 [&](const Triangle& t, std::size_t c) { ++start_[t[c]]; });
        before[part + 1] = std::accumulate(start_.data() + begin, start_.data() + end, std::size_t{0});
    });
    std::partial_sum(before.begin(), before.end(), before.begin());
    Buffer<Corner> corners(neighbours_.size());
    for_each_part([&](std::size_t part, std::size_t begin, std::size_t end) {
        // Each entry begins as the end of a list, and goes down to its begin.
        std::size_t sum = before[part];
        for (std::size_t p = begin; p < end; ++p) start_[p] = sum += start_[p];
        for_each_corner_backward(triangles, reaches, begin, end, [&](const Triangle& t, std::size_t c) {
            corners[--start_[t[c]]] = {t[(c + 1) % 3], t[(c + 2) % 3]};
        });
    });
    start_[points] = neighbours_.size();
    tbb::parallel_for(std::size_t{0}, chunks_.size(),
                      [&](std::size_t chunk) { list_chunk(corners.data(), chunk); });
}

void OneRings::list_chunk(const Corner* corners, std::size_t chunk) {
    const std::size_t begin = chunk * kChunk, end = std::min(begin + kChunk, size());
    Chunk& c = chunks_[chunk];
    c.reach = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end - 1)};
    std::array<std::uint8_t, kChunk> list;
    std::array<std::uint16_t, kMaxListed + 2> counts{};
    for (std::size_t p = begin; p < end; ++p) {
        const auto point = static_cast<std::uint32_t>(p);
        const std::span<const Corner> at_point{corners + start_[p], corners + start_[p + 1]};
        std::uint32_t* const ring = neighbours_.data() + start_[p];
        if (walk_around(point, at_point, ring)) {
            kinds_[p] = Kind::kFan;
        } else {
            kinds_[p] = are_manifold(point, at_point) ? Kind::kRegular : Kind::kIrregular;
            std::transform(at_point.begin(), at_point.end(), ring, [](const Corner& at) { return at.next; });
        }
        for (const std::uint32_t q : of(p)) c.reach = {std::min(c.reach[0], q), std::max(c.reach[1], q)};
        const bool is_listed = kinds_[p] == Kind::kFan && at_point.size() <= kMaxListed;
        list[p - begin] = static_cast<std::uint8_t>(is_listed ? at_point.size() : 0);
        ++counts[list[p - begin] + 1u];
    }
    std::partial_sum(counts.begin(), counts.end(), counts.begin());
    c.begin = counts;
    for (std::size_t p = begin; p < end; ++p)
        listed_[begin + counts[list[p - begin]]++] = static_cast<std::uint32_t>(p);
}

}  // namespace marrow::internal
