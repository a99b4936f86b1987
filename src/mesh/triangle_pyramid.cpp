// Compares a box with eight others at once. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/triangle_pyramid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include <tbb/parallel_for.h>

#include "morton_curve.h"
#include "triangle_pyramid.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Group = TrianglePyramid::Group;
using Leaf = TrianglePyramid::Leaf;
constexpr std::size_t kWidth = TrianglePyramid::kWidth;

// Returns a bit for each lane of eight for which mask(first lane) is set.
template <class Mask>
HWY_INLINE std::uint32_t bits_of_eight(const Mask& mask) {
    const hn::CappedTag<float, kWidth> d;
    std::uint32_t bits = 0;
    for (std::size_t c = 0; c < kWidth; c += hn::Lanes(d)) {
        std::uint8_t part[8] = {};
        hn::StoreMaskBits(d, mask(c), part);
        bits |= static_cast<std::uint32_t>(part[0]) << c;
    }
    return bits;
}

// Which boxes of `group`, from lane c on, overlap or touch box i of `from`.
HWY_INLINE auto overlap(const Group& from, std::size_t i, const Group& group, std::size_t c) {
    const hn::CappedTag<float, kWidth> d;
    const auto axis_overlaps = [&](std::size_t axis) HWY_ATTR {
        return hn::And(hn::Le(hn::LoadU(d, group.lower[axis] + c), hn::Set(d, from.upper[axis][i])),
                       hn::Ge(hn::LoadU(d, group.upper[axis] + c), hn::Set(d, from.lower[axis][i])));
    };
    return hn::And(hn::And(axis_overlaps(0), axis_overlaps(1)), axis_overlaps(2));
}

HWY_INLINE std::uint32_t overlaps(const Group& from, std::size_t i, const Group& group) {
    return bits_of_eight([&](std::size_t c) HWY_ATTR { return overlap(from, i, group, c); });
}

// Returns a bit for each triangle of `leaf` that shares a corner with triangle i of `from`.
HWY_INLINE std::uint32_t neighbours(const Leaf& from, std::size_t i, const Leaf& leaf) {
    const hn::CappedTag<float, kWidth> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    return bits_of_eight([&](std::size_t c) HWY_ATTR {
        auto shared = hn::Ne(hn::Zero(du), hn::Zero(du));
        for (std::size_t a = 0; a < 3; ++a) {
            const auto corner = hn::Set(du, from.corners[a][i]);
            for (std::size_t b = 0; b < 3; ++b)
                shared = hn::Or(shared, hn::Eq(corner, hn::LoadU(du, leaf.corners[b] + c)));
        }
        return hn::RebindMask(d, shared);
    });
}

template <class F>
HWY_INLINE void for_each_bit(std::uint32_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

constexpr std::uint32_t from_bit(std::size_t i) {
    return ~std::uint32_t{0} << i;
}

TrianglePair ordered(std::uint32_t s, std::uint32_t t) {
    return s < t ? TrianglePair{s, t} : TrianglePair{t, s};
}

class PairFinder {
  public:
    PairFinder(const Buffer<Leaf>& leaves, const std::vector<Buffer<Group>>& levels,
               std::vector<TrianglePair>& pairs)
        : leaves_(leaves), levels_(levels), pairs_(pairs) {}

    void find_from(std::size_t unit) {
        Group own;
        own.set(0, levels_[0][unit].bounds());
        descend(levels_.size() - 1, 0, own, unit);
    }

  private:
    // Visits the units from `unit` on below group `at` of a level.
    void descend(std::size_t level, std::size_t at, const Group& own, std::size_t unit) {
        if (level == 0) return compare_units(unit, at);
        for_each_bit(overlaps(own, 0, levels_[level][at]), [&](std::uint32_t i) {
            const std::size_t child = kWidth * at + i;
            if ((child + 1) << 3 * (level - 1) > unit) descend(level - 1, child, own, unit);
        });
    }
    HWY_INLINE void compare_units(std::size_t a, std::size_t b) {
        for (std::size_t i = 0; i < kWidth; ++i) {
            std::uint32_t bits = overlaps(levels_[0][a], i, levels_[0][b]);
            if (a == b) bits &= from_bit(i);
            for_each_bit(bits, [&](std::uint32_t j) {
                compare_leaves(kWidth * a + i, levels_[0][b], j, kWidth * b + j);
            });
        }
    }
    HWY_INLINE void compare_leaves(std::size_t a, const Group& bounds, std::size_t j, std::size_t b) {
        const Leaf &s = leaves_[a], &t = leaves_[b];
        // Only the boxes of `a` that overlap the bounds of `b` can overlap its boxes.
        for_each_bit(overlaps(bounds, j, s.boxes), [&](std::uint32_t i) {
            const std::uint32_t simple = (s.simple >> i & 1) != 0 ? from_bit(0) : t.simple;
            std::uint32_t bits = overlaps(s.boxes, i, t.boxes) & ~(neighbours(s, i, t) & simple);
            if (a == b) bits &= from_bit(i + 1);
            for_each_bit(bits, [&](std::uint32_t k) { pairs_.push_back(ordered(s.triangles[i], t.triangles[k])); });
        });
    }

    const Buffer<Leaf>& leaves_;
    const std::vector<Buffer<Group>>& levels_;
    std::vector<TrianglePair>& pairs_;
};

void find_pairs(const Buffer<Leaf>& leaves, const std::vector<Buffer<Group>>& levels, std::size_t unit,
                std::vector<TrianglePair>& pairs) {
    PairFinder(leaves, levels, pairs).find_from(unit);
}

// Appends the triangles whose boxes overlap or touch a box.
void find_overlapping(const Buffer<Leaf>& leaves, const std::vector<Buffer<Group>>& levels, const Group& box,
                      std::vector<std::uint32_t>& triangles) {
    const auto descend = [&](const auto& self, std::size_t level, std::size_t at) -> void {
        for_each_bit(overlaps(box, 0, levels[level][at]), [&](std::uint32_t i) {
            const std::size_t child = kWidth * at + i;
            if (level > 0) return self(self, level - 1, child);
            const Leaf& leaf = leaves[child];
            for_each_bit(overlaps(box, 0, leaf.boxes),
                         [&](std::uint32_t k) { triangles.push_back(leaf.triangles[k]); });
        });
    };
    descend(descend, levels.size() - 1, 0);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_pairs);
HWY_EXPORT(find_overlapping);

namespace {

Bounds bounds_of_triangle(const MeshView& mesh, std::uint32_t triangle) {
    Bounds box;
    for (const std::uint32_t p : mesh.triangles[triangle]) box.include(mesh.points[p]);
    return box;
}

}  // namespace

void TrianglePyramid::Group::set(std::size_t i, const Bounds& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        lower[axis][i] = box.lower[axis];
        upper[axis][i] = box.upper[axis];
    }
}

Bounds TrianglePyramid::Group::bounds() const {
    Bounds all;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        all.lower[axis] = *std::min_element(lower[axis], lower[axis] + kWidth);
        all.upper[axis] = *std::max_element(upper[axis], upper[axis] + kWidth);
    }
    return all;
}

TrianglePyramid::TrianglePyramid(MeshView mesh, std::span<const std::uint8_t> simple)
    : mesh_(mesh), leaves_(std::max<std::size_t>(1, (mesh.triangles.size() + kWidth - 1) / kWidth)) {
    const std::vector<MortonKey> row = along_morton_curve(mesh);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves_.size(), 512), [&](const auto& range) {
        for (std::size_t g = range.begin(); g < range.end(); ++g) {
            Leaf& leaf = leaves_[g];
            leaf.simple = 0;
            for (std::size_t i = 0; i < kWidth; ++i) {
                const bool is_used = kWidth * g + i < row.size();
                leaf.boxes.set(i, is_used ? bounds_of_triangle(mesh, row[kWidth * g + i].triangle) : Bounds{});
                const std::uint32_t t = leaf.triangles[i] = is_used ? row[kWidth * g + i].triangle : 0;
                bool all_simple = true;
                for (std::size_t c = 0; c < 3; ++c) {
                    leaf.corners[c][i] = is_used ? mesh.triangles[t][c] : 0;
                    all_simple = is_used && all_simple && simple[leaf.corners[c][i]] != 0;
                }
                leaf.simple |= static_cast<std::uint32_t>(all_simple) << i;
            }
        }
    });
    const auto add_level = [&](std::size_t count, const auto& box) {
        Buffer<Group> level((count + kWidth - 1) / kWidth);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.size(), 512), [&](const auto& range) {
            for (std::size_t g = range.begin(); g < range.end(); ++g) {
                for (std::size_t i = 0; i < kWidth; ++i)
                    level[g].set(i, kWidth * g + i < count ? box(kWidth * g + i) : Bounds{});
            }
        });
        levels_.push_back(std::move(level));
    };
    add_level(leaves_.size(), [&](std::size_t i) { return leaves_[i].boxes.bounds(); });
    while (levels_.back().size() > 1) {
        const Buffer<Group>& below = levels_.back();
        add_level(below.size(), [&](std::size_t i) { return below[i].bounds(); });
    }
}

void TrianglePyramid::pairs_from(std::size_t unit, std::vector<TrianglePair>& pairs) const {
    HWY_DYNAMIC_DISPATCH(find_pairs)(leaves_, levels_, unit, pairs);
}

std::vector<std::uint32_t> TrianglePyramid::overlapping(const Bounds& box) const {
    Group group;
    group.set(0, box);
    std::vector<std::uint32_t> triangles;
    HWY_DYNAMIC_DISPATCH(find_overlapping)(leaves_, levels_, group, triangles);
    return triangles;
}

void TrianglePyramid::update(std::uint32_t triangle) {
    if (places_.empty()) {
        places_.resize(mesh_.triangles.size());
        for (std::uint32_t i = 0; i < places_.size(); ++i)
            places_[leaves_[i / kWidth].triangles[i % kWidth]] = i;
    }
    std::size_t place = places_[triangle];
    leaves_[place / kWidth].boxes.set(place % kWidth, bounds_of_triangle(mesh_, triangle));
    Bounds bounds = leaves_[place / kWidth].boxes.bounds();
    for (Buffer<Group>& level : levels_) {
        place /= kWidth;
        level[place / kWidth].set(place % kWidth, bounds);
        bounds = level[place / kWidth].bounds();
    }
}

}  // namespace marrow::internal
#endif
