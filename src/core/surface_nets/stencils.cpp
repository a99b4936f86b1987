// Lists the stencils of a surface net's points.
//
// There is no vector code, but the ids of neighbours come from each target's population count. Without it,
// relaxation takes a twentieth longer.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/stencils.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "stencils.h"

#include "base/parallel.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// Stands for a missing face.
constexpr std::uint8_t kNoFace = 6;

// For each set of faces (bit f: face f) these faces, followed by kNoFace.
constexpr std::array<std::array<std::uint8_t, 6>, 64> kFacesOfSet = [] {
    std::array<std::array<std::uint8_t, 6>, 64> result{};
    for (std::size_t set = 0; set < result.size(); ++set) {
        result[set].fill(kNoFace);
        std::size_t count = 0;
        for (std::uint8_t f = 0; f < 6; ++f) {
            if ((set >> f & 1) != 0) result[set][count++] = f;
        }
    }
    return result;
}();

// Lists the stencils of points, row by row.
class StencilBuilder {
  public:
    StencilBuilder(const SurfaceNet& net, SliceStencils& stencils)
        : net_(net), missing_(static_cast<std::uint32_t>(net.point_count())), stencils_(stencils) {}

    void add_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        if (!bits.has_active_cells(j, k)) return;
        const CellRow row(bits, j, k);
        // The rows beyond faces 2 to 5. At the ends of the map any row will do, as no edge of these faces is
        // crossed.
        const CellRow adjacent[4] = {
            CellRow(bits, std::max<std::int64_t>(j - 1, 0), k), CellRow(bits, j + 1, k),
            CellRow(bits, j, std::max<std::int64_t>(k - 1, 0)), CellRow(bits, j, k + 1)};
        for (std::size_t w = 0; w < bits.words; ++w) {
            if (row.active[w] == 0) continue;
            const std::uint64_t multi_label = row.multi_label[w];
            std::uint64_t near_multi_label = multi_label << 1 | multi_label >> 1;
            if (w > 0) near_multi_label |= row.multi_label[w - 1] >> 63;
            if (w + 1 < bits.words) near_multi_label |= row.multi_label[w + 1] << 63;
            for (const CellRow& other : adjacent) near_multi_label |= other.multi_label[w];
            std::uint32_t id = row.word(w).first;
            for (std::uint64_t left = row.active[w]; left != 0; left &= left - 1, ++id) {
                const std::uint64_t bit = left & -left;
                PointsByFace points = {id - 1, id + 1};
                for (std::size_t r = 0; r < 4; ++r) points[2 + r] = adjacent[r].word(w).id(bit - 1);
                points[kNoFace] = missing_;
                const unsigned faces = (multi_label & bit) != 0
                                           ? net_.multi_label_cell(k, id).pattern->neighbours
                                           : cases_[net_.cases[id]].neighbours;
                if ((near_multi_label & bit) != 0) use_extra_points(k, faces, points);
                add(id, faces, points);
            }
        }
    }

  private:
    using PointsByFace = std::array<std::uint32_t, 7>;

    // If a neighbour is a multi-label cell, its point on the common face may be another than its first.
    HWY_NOINLINE void use_extra_points(std::int64_t k, unsigned faces, PointsByFace& points) const {
        for (std::size_t f = 0; f < 6; ++f) {
            if ((faces >> f & 1) == 0 || net_.cases[points[f]] != 0) continue;
            const std::int64_t slice = f == 4 ? k - 1 : f == 5 ? k + 1 : k;
            const MultiLabelCell& cell = net_.multi_label_cell(slice, points[f]);
            // A cell whose point moves has one junction on each face, so the face belongs to one point of the
            // neighbour.
            const std::uint8_t point = cell.pattern->point_of_face[f ^ 1];
            if (point != CellPattern::kNone && point > 0)
                points[f] =
                    static_cast<std::uint32_t>(net_.extra_point(net_.slab_of_slice(slice), cell, point));
        }
    }

    HWY_INLINE void add(std::uint32_t id, unsigned faces, const PointsByFace& points) {
        if (faces == 0) return;
        const std::array<std::uint8_t, 6>& order = kFacesOfSet[faces];
        const auto point = [&](std::size_t n) { return points[order[n]]; };
        if (order[4] == kNoFace)
            stencils_.up_to_four[stencils_.up_to_four_count++] = {
                id, faces, {point(0), point(1), point(2), point(3)}};
        else
            stencils_.more.push_back(
                {id, faces, {point(0), point(1), point(2), point(3), point(4), point(5)}});
    }

    const SurfaceNet& net_;
    const std::uint32_t missing_;
    const std::array<TwoLabelCase, 128>& cases_ = two_label_cases();
    SliceStencils& stencils_;
};

void list_stencils(const SurfaceNet& net, std::int64_t k, SliceStencils& stencils) {
    StencilBuilder builder(net, stencils);
    for (std::int64_t j = 0; j < net.bits.cell_rows(); ++j) builder.add_row(j, k);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(list_stencils);

std::vector<SliceStencils> make_stencils(const SurfaceNet& net, const Progress& progress) {
    const BorderBits& bits = net.bits;
    std::vector<SliceStencils> stencils(static_cast<std::size_t>(bits.cell_slices()));
    Stage stage(progress, 0, 1, stencils.size());
    parallel_for(std::int64_t{0}, bits.cell_slices(), [&](std::int64_t k) {
        SliceStencils& slice = stencils[static_cast<std::size_t>(k)];
        slice.up_to_four.resize(bits.first_cell[bits.row(0, k + 1)] - bits.first_cell[bits.row(0, k)]);
        HWY_DYNAMIC_DISPATCH(list_stencils)(net, k, slice);
        stage.step();
    });
    return stencils;
}

}  // namespace marrow::internal
#endif
