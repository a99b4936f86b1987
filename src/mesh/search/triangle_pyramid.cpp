// Compares a box with eight others at once. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/search/triangle_pyramid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "base/parallel.h"
#include "morton_curve.h"
#include "triangle_pyramid.h"
#include "triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Group = TrianglePyramid::Group;
using Leaf = TrianglePyramid::Leaf;
constexpr std::size_t kWidth = TrianglePyramid::kWidth;

using D = hn::CappedTag<float, kWidth>;
using DU = hn::RebindToUnsigned<D>;

// A box in all lanes.
struct Box {
    hn::Vec<D> lower[3], upper[3];
};

HWY_INLINE Box box_of(const Group& group, std::size_t i) {
    const D d;
    return {{hn::Set(d, group.lower[0][i]), hn::Set(d, group.lower[1][i]), hn::Set(d, group.lower[2][i])},
            {hn::Set(d, group.upper[0][i]), hn::Set(d, group.upper[1][i]), hn::Set(d, group.upper[2][i])}};
}

// Which boxes of a group, from lane c on, overlap or touch a box.
HWY_INLINE auto overlap(const Box& box, const Group& group, std::size_t c) {
    const D d;
    // The sign of a float difference is exact. Processors with masks make only one mask in a cycle.
    const auto gap = [&](std::size_t axis) HWY_ATTR {
        return hn::Max(hn::Sub(hn::LoadU(d, group.lower[axis] + c), box.upper[axis]),
                       hn::Sub(box.lower[axis], hn::LoadU(d, group.upper[axis] + c)));
    };
    return hn::Le(hn::Max(hn::Max(gap(0), gap(1)), gap(2)), hn::Zero(d));
}

// Returns a bit for each lane of eight that is set in mask(first lane).
template <class Mask>
HWY_INLINE std::uint32_t bits_of_eight(const Mask& mask) {
    const D d;
    std::uint32_t bits = 0;
    for (std::size_t c = 0; c < kWidth; c += hn::Lanes(d)) {
        std::uint8_t part[8] = {};
        hn::StoreMaskBits(d, mask(c), part);
        bits |= static_cast<std::uint32_t>(part[0]) << c;
    }
    return bits;
}

HWY_INLINE std::uint32_t overlaps(const Box& box, const Group& group) {
    return bits_of_eight([&](std::size_t c) HWY_ATTR { return overlap(box, group, c); });
}

// Which triangles of a leaf, from lane c on, share a corner with triangle i of another leaf.
HWY_INLINE auto is_neighbour(const Leaf& other, std::size_t i, const Leaf& leaf, std::size_t c) {
    const DU du;
    auto shared = hn::Ne(hn::Zero(du), hn::Zero(du));
    for (std::size_t a = 0; a < 3; ++a) {
        const auto corner = hn::Set(du, other.corners[a][i]);
        for (std::size_t b = 0; b < 3; ++b)
            shared = hn::Or(shared, hn::Eq(corner, hn::LoadU(du, leaf.corners[b] + c)));
    }
    return hn::RebindMask(D(), shared);
}

template <class F>
HWY_INLINE void for_each_bit(std::uint32_t bits, const F& f) {
    for (; bits != 0; bits &= bits - 1) f(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

HWY_INLINE TrianglePair ordered(std::uint32_t s, std::uint32_t t) {
    return s < t ? TrianglePair{s, t} : TrianglePair{t, s};
}

// Stores the lanes of a vector that a mask selects, and garbage beyond them. Returns their number.
HWY_INLINE std::size_t store_selected(hn::Vec<DU> v, hn::Mask<D> mask, std::uint32_t* to) {
    const DU du;
    hn::StoreU(hn::Compress(v, hn::RebindMask(du, mask)), du, to);
    return hn::CountTrue(D(), mask);
}

// Numbered boxes, eight after eight.
struct BoxList {
    std::size_t count = 0;
    std::vector<Group> groups;
    std::vector<std::uint32_t> numbers;

    void add(std::uint32_t number, const Group& group, std::size_t i) {
        if (count == numbers.size()) {
            groups.resize(2 * groups.size() + 1);
            numbers.resize(kWidth * groups.size());
        }
        Group& last = groups[count / kWidth];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            last.lower[axis][count % kWidth] = group.lower[axis][i];
            last.upper[axis][count % kWidth] = group.upper[axis][i];
        }
        numbers[count++] = number;
    }
    // Stores the numbers of the boxes that overlap `box`, each 8 times and plus `addend`. Returns how many.
    HWY_INLINE std::size_t list_overlapping(const Box& box, std::uint32_t addend, std::uint32_t* to) const {
        const D d;
        const DU du;
        std::size_t found = 0;
        for (std::size_t n = 0; n < count; n += hn::Lanes(d)) {
            const auto mask = hn::And(hn::FirstN(d, count - n), overlap(box, groups[n / kWidth], n % kWidth));
            const auto entries = hn::Add(hn::ShiftLeft<3>(hn::LoadU(du, &numbers[n])), hn::Set(du, addend));
            found += store_selected(entries, mask, to + found);
        }
        return found;
    }
};

// Finds the pairs of a unit. A processor cannot guess which boxes overlap, so each step writes a list for the
// next one, without branches.
class PairFinder {
  public:
    PairFinder(const Buffer<Leaf>& leaves, const Buffer<std::uint8_t>& simple,
               const std::vector<Buffer<Group>>& levels, std::vector<TrianglePair>& pairs)
        : leaves_(leaves), simple_(simple), levels_(levels), pairs_(pairs) {}

    void find_from(std::size_t unit) {
        Group own;
        own.set(0, levels_[0][unit].bounds());
        near_units_.count = 0;
        if (levels_.size() == 1)
            near_units_.add(0, own, 0);
        else
            list_units(levels_.size() - 1, 0, box_of(own, 0), unit);
        for (std::size_t leaf = kWidth * unit; leaf < std::min(kWidth * (unit + 1), leaves_.size()); ++leaf) {
            list_leaves(leaf);
            compare_rows(leaf, list_rows(leaf));
        }
    }

  private:
    // Lists the units from `unit` on that overlap a box, below group `at` of a level above theirs.
    void list_units(std::size_t level, std::size_t at, const Box& box, std::size_t unit) {
        for_each_bit(overlaps(box, levels_[level][at]), [&](std::uint32_t i) {
            const std::size_t child = kWidth * at + i;
            if (level == 1 && child >= unit)
                near_units_.add(static_cast<std::uint32_t>(child), levels_[level][at], i);
            if (level > 1 && (child + 1) << 3 * (level - 1) > unit) list_units(level - 1, child, box, unit);
        });
    }

    // Lists the leaves from `leaf` on that overlap it.
    HWY_INLINE void list_leaves(std::size_t leaf) {
        const D d;
        const DU du;
        const Box box = box_of(levels_[0][leaf / kWidth], leaf % kWidth);
        units_.resize(near_units_.count + kWidth);
        units_.resize(near_units_.list_overlapping(box, 0, units_.data()));
        numbers_.resize(kWidth * units_.size() + kWidth);
        std::size_t count = 0;
        for (const std::uint32_t first : units_) {
            for (std::size_t c = 0; c < kWidth; c += hn::Lanes(d)) {
                const auto numbers = hn::Iota(du, first + static_cast<std::uint32_t>(c));
                count +=
                    store_selected(numbers, overlap(box, levels_[0][first / kWidth], c), &numbers_[count]);
            }
        }
        near_leaves_.count = 0;
        for (std::size_t n = 0; n < count; ++n) {
            if (numbers_[n] >= leaf)
                near_leaves_.add(numbers_[n], levels_[0][numbers_[n] / kWidth], numbers_[n] % kWidth);
        }
    }

    // Lists the listed leaves that overlap each triangle of `leaf`, as 8 * (number of the leaf) + (place of
    // the triangle). Returns the number of entries.
    HWY_INLINE std::size_t list_rows(std::size_t leaf) {
        std::size_t count = 0;
        rows_.resize(kWidth * near_leaves_.count + kWidth);
        for (std::size_t i = 0; i < kWidth; ++i)
            count += near_leaves_.list_overlapping(box_of(leaves_[leaf].boxes, i),
                                                   static_cast<std::uint32_t>(i), &rows_[count]);
        return count;
    }

    // Compares the triangle of each row with all triangles of the other leaf.
    HWY_INLINE void compare_rows(std::size_t leaf, std::size_t row_count) {
        const Leaf& s = leaves_[leaf];
        for (std::size_t row = 0; row < row_count; ++row) {
            const std::size_t i = rows_[row] % kWidth, other = rows_[row] / kWidth;
            const Leaf& t = leaves_[other];
            const Box box = box_of(s.boxes, i);
            std::uint32_t bits;
            if ((simple_[leaf] >> i & 1) != 0) {
                bits = bits_of_eight([&](std::size_t c) HWY_ATTR {
                    return hn::AndNot(is_neighbour(s, i, t, c), overlap(box, t.boxes, c));
                });
            } else {
                bits = bits_of_eight([&](std::size_t c) HWY_ATTR { return is_neighbour(s, i, t, c); });
                bits = overlaps(box, t.boxes) & ~(bits & simple_[other]);
            }
            // Of two triangles in a leaf, the first one looks at the second.
            if (other == leaf) bits &= ~std::uint32_t{0} << (i + 1);
            for_each_bit(bits,
                         [&](std::uint32_t k) { pairs_.push_back(ordered(s.triangles[i], t.triangles[k])); });
        }
    }

    const Buffer<Leaf>& leaves_;
    const Buffer<std::uint8_t>& simple_;
    const std::vector<Buffer<Group>>& levels_;
    std::vector<TrianglePair>& pairs_;
    BoxList near_units_, near_leaves_;
    std::vector<std::uint32_t> units_, numbers_;
    std::vector<std::uint32_t> rows_;
};

void find_pairs(const Buffer<Leaf>& leaves, const Buffer<std::uint8_t>& simple,
                const std::vector<Buffer<Group>>& levels, std::size_t begin, std::size_t end,
                std::vector<TrianglePair>& pairs) {
    PairFinder finder(leaves, simple, levels, pairs);
    for (std::size_t unit = begin; unit < end; ++unit) finder.find_from(unit);
}

// Appends the triangles whose boxes overlap or touch a box.
void find_overlapping(const Buffer<Leaf>& leaves, const std::vector<Buffer<Group>>& levels, const Group& box,
                      std::vector<std::uint32_t>& triangles) {
    const Box wanted = box_of(box, 0);
    const auto descend = [&](const auto& self, std::size_t level, std::size_t at) -> void {
        for_each_bit(overlaps(wanted, levels[level][at]), [&](std::uint32_t i) {
            const std::size_t child = kWidth * at + i;
            if (level > 0) return self(self, level - 1, child);
            const Leaf& leaf = leaves[child];
            for_each_bit(overlaps(wanted, leaf.boxes),
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

void TrianglePyramid::Group::set(std::size_t i, const Bounds& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        lower[axis][i] = box.lower[axis];
        upper[axis][i] = box.upper[axis];
    }
}

Bounds TrianglePyramid::Group::box(std::size_t i) const {
    return {{lower[0][i], lower[1][i], lower[2][i]}, {upper[0][i], upper[1][i], upper[2][i]}};
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
    : mesh_(mesh),
      leaves_(std::max<std::size_t>(1, (mesh.triangles.size() + kWidth - 1) / kWidth)),
      simple_(leaves_.size()) {
    const Buffer<std::uint32_t> row = by_morton_cells(mesh);
    parallel_for_ranges(std::size_t{0}, leaves_.size(), 512, [&](const auto& range) {
        for (std::size_t g = range.begin(); g < range.end(); ++g) {
            Leaf& leaf = leaves_[g];
            std::uint32_t all_simple = 0;
            for (std::size_t i = 0; i < kWidth; ++i) {
                const std::size_t place = kWidth * g + i;
                const std::uint32_t t = leaf.triangles[i] = place < row.size() ? row[place] : 0;
                const Triangle corners = place < row.size() ? mesh.triangles[t] : Triangle{};
                leaf.boxes.set(i, place < row.size() ? bounds_of(mesh, corners) : Bounds{});
                for (std::size_t c = 0; c < 3; ++c) leaf.corners[c][i] = corners[c];
                if (place < row.size() && !simple.empty())
                    all_simple |= static_cast<std::uint32_t>(simple[corners[0]] & simple[corners[1]] &
                                                             simple[corners[2]])
                                  << i;
            }
            simple_[g] = static_cast<std::uint8_t>(all_simple);
        }
    });
    const auto add_level = [&](std::size_t count, const auto& box) {
        Buffer<Group> level((count + kWidth - 1) / kWidth);
        parallel_for_ranges(std::size_t{0}, level.size(), 512, [&](const auto& range) {
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

void TrianglePyramid::pairs_from(std::size_t begin, std::size_t end, std::vector<TrianglePair>& pairs) const {
    HWY_DYNAMIC_DISPATCH(find_pairs)(leaves_, simple_, levels_, begin, end, pairs);
}

std::vector<std::uint32_t> TrianglePyramid::overlapping(const Bounds& box) const {
    Group group;
    group.set(0, box);
    std::vector<std::uint32_t> triangles;
    HWY_DYNAMIC_DISPATCH(find_overlapping)(leaves_, levels_, group, triangles);
    return triangles;
}

void TrianglePyramid::set_box(std::uint32_t triangle, const Bounds& box) {
    if (places_.empty()) {
        places_.resize(mesh_.triangles.size());
        parallel_for_ranges(std::size_t{0}, places_.size(), 8192, [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                places_[leaves_[i / kWidth].triangles[i % kWidth]] = static_cast<std::uint32_t>(i);
        });
    }
    std::size_t place = places_[triangle];
    leaves_[place / kWidth].boxes.set(place % kWidth, box);
    Bounds bounds = leaves_[place / kWidth].boxes.bounds();
    for (Buffer<Group>& level : levels_) {
        place /= kWidth;
        Group& group = level[place / kWidth];
        if (bounds == group.box(place % kWidth)) break;  // then nothing above changes either
        group.set(place % kWidth, bounds);
        bounds = group.bounds();
    }
}

}  // namespace marrow::internal
#endif
