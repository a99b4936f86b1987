// Compares several pairs of triangles at once. Highway compiles this file once for each SIMD target.
//
// Two triangles that have no point in common do not intersect if a plane separates them. If they have one in
// common, the plane may go through it. The plane between the directions from there to both nearly always
// does; without a common point, the plane perpendicular to the line between their centroids. Any plane will
// do, so its direction may be rounded. Only the order of the corners in this direction counts. Most other
// triangles are on one side of the plane through the other one.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/close_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>

#include "close_triangles.h"

#include "base/resize_discarding.h"
#include "mesh/geometry/load_points-inl.h"
#include "mesh/geometry/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, LayerPairs::kSlack>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;

HWY_INLINE Vectors<D> if_then_else_zero(hn::Mask<D> mask, const Vectors<D>& a) {
    return {hn::IfThenElseZero(mask, a.x), hn::IfThenElseZero(mask, a.y), hn::IfThenElseZero(mask, a.z)};
}

struct Corners {
    Vectors<D> position[3];
    VI point[3];

    // Loads triangles of a layer from where they begin.
    HWY_INLINE Corners(const float* layer, const std::uint32_t* begins) {
        const D d;
        for (std::size_t c = 0; c < 3; ++c) {
            V fours[4];
            load_fours(
                d, [&](std::size_t lane) { return layer + begins[lane] + 4 * c; }, fours);
            position[c] = {fours[0], fours[1], fours[2]};
            point[c] = hn::BitCast(DI(), fours[3]);
        }
    }
};

// Which corners of two triangles are common to both.
struct Common {
    hn::Mask<D> s[3], t[3];

    HWY_INLINE Common(const Corners& a, const Corners& b) {
        const D d;
        hn::Mask<DI> equal[3][3];
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t k = 0; k < 3; ++k) equal[i][k] = hn::Eq(a.point[i], b.point[k]);
        }
        for (std::size_t i = 0; i < 3; ++i) {
            s[i] = hn::RebindMask(d, hn::Or(hn::Or(equal[i][0], equal[i][1]), equal[i][2]));
            t[i] = hn::RebindMask(d, hn::Or(hn::Or(equal[0][i], equal[1][i]), equal[2][i]));
        }
    }
    HWY_INLINE hn::Mask<D> any() const { return hn::Or(hn::Or(s[0], s[1]), s[2]); }
    HWY_INLINE hn::Mask<D> is_edge() const {
        return hn::Or(hn::And(s[0], hn::Or(s[1], s[2])), hn::And(s[1], s[2]));
    }
};

// The direction from triangles s to triangles t in which they may be separate, of any length. All corners are
// relative to the same position; the first of s is there.
HWY_INLINE Vectors<D> direction_between(const Vectors<D> (&s)[3], const Vectors<D> (&t)[3],
                                        const Common& common) {
    const D d;
    const Vectors<D> s_sum = s[1] + s[2], t_sum = t[0] + t[1] + t[2];
    const Vectors<D> at_point = if_then_else_zero(common.s[1], s[1]) + if_then_else_zero(common.s[2], s[2]);
    const V sixth = hn::IfThenZeroElse(common.any(), hn::Set(d, 1.0f / 6));
    const Vectors<D> from = at_point + sixth * (s_sum + t_sum);
    const Vectors<D> from3 = hn::Set(d, 3) * from;
    const Vectors<D> to_s = s_sum - from3, to_t = t_sum - from3;
    const V one = hn::Set(d, 1);
    return hn::Div(one, dot(to_t, to_t)) * to_t - hn::Div(one, dot(to_s, to_s)) * to_s;
}

HWY_INLINE V sum_of_sizes(const Vectors<D>& a) {
    return hn::Add(hn::Add(hn::Abs(a.x), hn::Abs(a.y)), hn::Abs(a.z));
}

// Whether triangles s and t are on different sides of a plane across this direction.
HWY_INLINE hn::Mask<D> are_separate(const Vectors<D>& direction, const Vectors<D> (&s)[3],
                                    const Vectors<D> (&t)[3], const Common& common, V most_apart) {
    const D d;
    const V along_s[3] = {hn::Zero(d), dot(direction, s[1]), dot(direction, s[2])};
    const V along_t[3] = {dot(direction, t[0]), dot(direction, t[1]), dot(direction, t[2])};
    // More than rounding changes in these, and in the differences of coordinates.
    const V margin = hn::Mul(hn::Mul(hn::Set(d, 2e-6f), most_apart), sum_of_sizes(direction));
    const V t_begin = hn::Sub(hn::Min(hn::Min(along_t[0], along_t[1]), along_t[2]), margin),
            s_end = hn::Add(hn::Max(hn::Max(along_s[0], along_s[1]), along_s[2]), margin);
    hn::Mask<D> separate = hn::Or(common.s[0], hn::Lt(along_s[0], t_begin));
    for (std::size_t c = 0; c < 3; ++c) {
        if (c > 0) separate = hn::And(separate, hn::Or(common.s[c], hn::Lt(along_s[c], t_begin)));
        separate = hn::And(separate, hn::Or(common.t[c], hn::Gt(along_t[c], s_end)));
    }
    return separate;
}

// Whether all corners of others, except for common ones, are on one side of the plane through triangles.
HWY_INLINE hn::Mask<D> are_beside(const Vectors<D> (&triangle)[3], const Vectors<D> (&others)[3],
                                  const hn::Mask<D> (&common)[3], V most_apart) {
    const D d;
    const Vectors<D> a = triangle[1] - triangle[0], b = triangle[2] - triangle[0];
    const Vectors<D> normal = cross(a, b);
    // More than rounding changes in the normal, in these differences and in products with both.
    const V margin =
        hn::Mul(hn::Mul(hn::Set(d, 8e-6f), most_apart), hn::Mul(sum_of_sizes(a), sum_of_sizes(b)));
    hn::Mask<D> above = hn::Lt(hn::Zero(d), hn::Set(d, 1)), below = above;
    for (std::size_t c = 0; c < 3; ++c) {
        const V height = dot(normal, others[c] - triangle[0]);
        above = hn::And(above, hn::Or(common[c], hn::Gt(height, margin)));
        below = hn::And(below, hn::Or(common[c], hn::Lt(height, hn::Neg(margin))));
    }
    return hn::Or(above, below);
}

// Which of several pairs may intersect.
HWY_INLINE hn::Mask<D> may_intersect(const Corners& a, const Corners& b, V most_apart) {
    const Common common(a, b);
    Vectors<D> s[3], t[3];
    for (std::size_t c = 0; c < 3; ++c) {
        s[c] = a.position[c] - a.position[0];
        t[c] = b.position[c] - a.position[0];
    }
    auto excluded =
        hn::Or(common.is_edge(), are_separate(direction_between(s, t, common), s, t, common, most_apart));
    if (HWY_UNLIKELY(!hn::AllTrue(D(), excluded))) {
        excluded = hn::Or(
            excluded, hn::Or(are_beside(s, t, common.t, most_apart), are_beside(t, s, common.s, most_apart)));
    }
    return hn::Not(excluded);
}

void find_close_pairs_target(const LayerTriangles& layer, const LayerTriangles& layer_of_second,
                             const LayerPairs& pairs, float most_apart, std::vector<TrianglePair>& close) {
    const D d;
    const std::size_t lanes = hn::Lanes(d);
    const std::uint32_t *const first = pairs.first.data(), *const second = pairs.second.data();
    const float *const corners = layer.corners.data(), *const corners_of_second =
                                                           layer_of_second.corners.data();
    for (std::size_t k = 0; k < pairs.count; k += lanes) {
        const Corners s(corners, first + k), t(corners_of_second, second + k);
        const auto found = may_intersect(s, t, hn::Set(d, most_apart));
        if (HWY_LIKELY(hn::AllFalse(d, found))) continue;
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, found, bits);
        for (unsigned left = bits[0] | static_cast<unsigned>(bits[1]) << 8; left != 0; left &= left - 1) {
            const std::size_t pair = k + static_cast<std::size_t>(std::countr_zero(left));
            if (pair < pairs.count)
                close.push_back(
                    {first[pair] / LayerTriangles::kFloats, second[pair] / LayerTriangles::kFloats});
        }
    }
}

// Triangles of a layer whose cells follow each other in a row.
struct Window {
    std::size_t begin = 0, end = 0;

    // Moves on to the triangles in the cells [first, last], which are not before the present ones.
    HWY_INLINE void move(const std::int32_t* cells, std::int32_t first, std::int32_t last) {
        const DI di;
        const std::size_t lanes = hn::Lanes(di);
        const auto count_below = [&](std::size_t from, std::int32_t cell) HWY_ATTR {
            return hn::CountTrue(di, hn::Lt(hn::LoadU(di, cells + from), hn::Set(di, cell)));
        };
        std::size_t passed = count_below(begin, first);
        begin += passed;
        while (HWY_UNLIKELY(passed == lanes)) begin += passed = count_below(begin, first);
        std::size_t inside = count_below(begin, last + 1);
        end = begin + inside;
        while (HWY_UNLIKELY(inside == lanes)) end += inside = count_below(end, last + 1);
    }
};

// Appends pairs without a branch: a vector is written, and the next pairs overwrite the surplus.
struct PairWriter {
    std::uint32_t *first, *second;

    explicit PairWriter(LayerPairs& pairs) : first(pairs.first.data()), second(pairs.second.data()) {}

    // Appends the pairs of triangle t with the triangles [begin, end).
    HWY_INLINE void write(std::uint32_t t, std::size_t begin, std::size_t end) {
        const hn::RebindToUnsigned<DI> du;
        const std::size_t lanes = hn::Lanes(du);
        const auto begins = hn::Mul(hn::Iota(du, 0), hn::Set(du, LayerTriangles::kFloats));
        const auto write_from = [&](std::size_t i) HWY_ATTR {
            const auto from = static_cast<std::uint32_t>(begin + i) * LayerTriangles::kFloats;
            hn::StoreU(hn::Set(du, t * LayerTriangles::kFloats), du, first + i);
            hn::StoreU(hn::Add(begins, hn::Set(du, from)), du, second + i);
        };
        const std::size_t count = end - begin;
        write_from(0);
        for (std::size_t i = lanes; HWY_UNLIKELY(i < count); i += lanes) write_from(i);
        first += count;
        second += count;
    }
    void finish(LayerPairs& pairs) const {
        pairs.count = static_cast<std::size_t>(first - pairs.first.data());
        if (pairs.count == 0) return;
        // Surplus lanes of the last vector repeat a pair.
        std::fill_n(first, LayerPairs::kSlack, first[-1]);
        std::fill_n(second, LayerPairs::kSlack, second[-1]);
    }
};

void list_neighbours_target(const LayerTriangles& layer, const LayerTriangles& next, std::int32_t per_row,
                            LayerPairs& pairs, LayerPairs& pairs_to_next) {
    const std::int32_t *const cells = layer.cells.data(), *const next_cells = next.cells.data();
    PairWriter writer(pairs), writer_to_next(pairs_to_next);
    Window row, next_y, before_y_next_z, next_z, next_yz;
    const auto count = static_cast<std::uint32_t>(layer.count);
    for (std::uint32_t t = 0; t < count;) {
        const std::int32_t cell = cells[t];
        row.move(cells, cell, cell + 1);
        next_y.move(cells, cell + per_row - 1, cell + per_row + 1);
        before_y_next_z.move(next_cells, cell - per_row - 1, cell - per_row + 1);
        next_z.move(next_cells, cell - 1, cell + 1);
        next_yz.move(next_cells, cell + per_row - 1, cell + per_row + 1);
        for (; cells[t] == cell; ++t) {
            writer.write(t, t + 1, row.end);
            writer.write(t, next_y.begin, next_y.end);
            writer_to_next.write(t, before_y_next_z.begin, before_y_next_z.end);
            writer_to_next.write(t, next_z.begin, next_z.end);
            writer_to_next.write(t, next_yz.begin, next_yz.end);
        }
    }
    writer.finish(pairs);
    writer_to_next.finish(pairs_to_next);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_close_pairs_target);
HWY_EXPORT(list_neighbours_target);

void pack_layer(const SnapOutput& surface, std::size_t begin, std::size_t end, LayerTriangles& to) {
    to.count = end - begin;
    resize_discarding(to.corners, to.count * LayerTriangles::kFloats);
    resize_discarding(to.cells, to.count + LayerTriangles::kSlack);
    float* corner = to.corners.data();
    for (std::size_t t = begin; t < end; ++t) {
        to.cells[t - begin] = static_cast<std::int32_t>(surface.cells[t]);
        for (const std::uint32_t p : surface.mesh.triangles[t]) {
            std::memcpy(corner, surface.mesh.points[p].data(), sizeof(Vec3f));
            std::memcpy(corner + 3, &p, sizeof p);
            corner += 4;
        }
    }
    std::fill_n(to.cells.data() + to.count, LayerTriangles::kSlack, std::numeric_limits<std::int32_t>::max());
}

void list_neighbours(const LayerTriangles& layer, const LayerTriangles& next, std::uint64_t cells_per_row,
                     LayerPairs& pairs, LayerPairs& pairs_to_next) {
    // No more than five triangles are in a cell.
    const std::size_t most = 5 * layer.count;
    for (LayerPairs* list : {&pairs, &pairs_to_next}) {
        const std::size_t cells = list == &pairs ? 5 : 9;
        resize_discarding(list->first, cells * most + LayerPairs::kSlack);
        resize_discarding(list->second, list->first.size());
    }
    HWY_DYNAMIC_DISPATCH(list_neighbours_target)
    (layer, next, static_cast<std::int32_t>(cells_per_row), pairs, pairs_to_next);
}

void find_close_pairs(const LayerTriangles& layer, const LayerTriangles& layer_of_second,
                      const LayerPairs& pairs, float most_apart, std::vector<TrianglePair>& close) {
    HWY_DYNAMIC_DISPATCH(find_close_pairs_target)(layer, layer_of_second, pairs, most_apart, close);
}

}  // namespace marrow::internal
#endif
