// Converts the points of cells to physical space and writes them to the meshes of labels.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/emit_points.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "writers.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Converts points of cells to physical space. The centres of cells are computed in double precision. There
// are no fused operations, so the result is the same on every processor.
class CellToPhysical {
  public:
    explicit CellToPhysical(const IndexToPhysical& to_physical) : first_(to_physical.first) {
        for (std::size_t r = 0; r < 3; ++r) {
            // The centre of cell (i, j, k) has index (i, j, k) - 1/2 in the volume, without the layer around
            // it. All indices count in the whole volume.
            origin_[r] = to_physical.origin[r] - 0.5 * to_physical.exact[r][0];
            for (std::size_t a = 0; a < 3; ++a) {
                exact_columns_[a][r] = to_physical.exact[r][a];
                columns_[a][r] = to_physical.matrix[r][a];
            }
        }
    }

    HWY_INLINE void set_row(std::int64_t j, std::int64_t k) {
        const auto y = hn::Set(kDouble, static_cast<double>(first_[1] + j) - 0.5),
                   z = hn::Set(kDouble, static_cast<double>(first_[2] + k) - 0.5);
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kDouble)) {
            const auto along_y = hn::Mul(hn::Load(kDouble, exact_columns_[1] + r), y),
                       along_z = hn::Mul(hn::Load(kDouble, exact_columns_[2] + r), z);
            hn::Store(hn::Add(hn::Add(hn::Load(kDouble, origin_ + r), along_y), along_z), kDouble, row_ + r);
        }
    }

    // The physical vector from the centre of a cell to a point.
    HWY_INLINE NetPoint vector_to(const NetPoint& point) const {
        NetPoint result;
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kFloat)) {
            auto sum = hn::Mul(hn::Load(kFloat, columns_[0] + r), hn::Set(kFloat, point.xyz[0]));
            for (std::size_t a = 1; a < 3; ++a)
                sum = hn::Add(sum, hn::Mul(hn::Load(kFloat, columns_[a] + r), hn::Set(kFloat, point.xyz[a])));
            hn::Store(sum, kFloat, result.xyz + r);
        }
        return result;
    }

    // The position that is `vector` away from the centre of cell i of the row.
    HWY_INLINE void add_centre(std::int64_t i, const NetPoint& vector, NetPoint& position) const {
        const auto x = hn::Set(kDouble, static_cast<double>(first_[0] + i));
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kFloat)) {
            const auto centre =
                hn::Add(hn::Load(kDouble, row_ + r), hn::Mul(hn::Load(kDouble, exact_columns_[0] + r), x));
            const auto away = hn::PromoteTo(kDouble, hn::Load(kFloat, vector.xyz + r));
            hn::Store(hn::DemoteTo(kFloat, hn::Add(centre, away)), kFloat, position.xyz + r);
        }
    }

  private:
    static constexpr hn::CappedTag<double, 4> kDouble{};
    static constexpr hn::Rebind<float, hn::CappedTag<double, 4>> kFloat{};
    const Index3 first_;
    alignas(32) double origin_[4] = {}, exact_columns_[3][4] = {}, row_[4] = {};
    alignas(16) float columns_[3][4] = {};
};

// Emits the points of cells.
class PointEmitter {
  public:
    PointEmitter(SurfaceNet& net, const IndexToPhysical& to_physical, PointWriter* writers)
        : net_(net), to_physical_(to_physical), writers_(writers) {
        for (std::size_t c = 0; c < vector_of_case_.size(); ++c)
            vector_of_case_[c] = to_physical_.vector_to(two_label_cases()[c].position);
    }

    // Emits the points of a row's two-label cells.
    void emit_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        if (!bits.has_active_cells(j, k)) return;
        const CellRow row(bits, j, k);
        to_physical_.set_row(j, k);
        // The compiler cannot know that these do not change while corners are written.
        const std::uint8_t* const cases = net_.cases.data();
        const LabelPair* const label_pairs = net_.label_pairs.data();
        const NetPoint* const points = net_.points.empty() ? nullptr : net_.points.data();
        QuadCorner* const corners = net_.corners.data();
        PointWriter* const writers = writers_;
        for (std::size_t w = 0; w < bits.words; ++w) {
            const CellWord word = row.word(w);
            for (std::uint64_t left = word.active & ~row.multi_label[w]; left != 0; left &= left - 1) {
                const std::uint32_t id = word.id((left & -left) - 1);
                const LabelPair labels = label_pairs[id];
                QuadCorner& corner = corners[id];
                const auto i = static_cast<std::int64_t>(64 * w) + std::countr_zero(left);
                if (points == nullptr)
                    to_physical_.add_centre(i, vector_of_case_[cases[id]], corner.position);
                else
                    to_physical_.add_centre(i, to_physical_.vector_to(points[id]), corner.position);
                corner.point[0] = writers[labels.lesser()].write(corner.position, id);
                corner.point[1] = writers[labels.greater()].write(corner.position, id);
                corner.labels = labels;
                corner.junction = {};
            }
        }
    }

    // Emits the points of a multi-label cell, whose corners begin at `first_corner`.
    void emit_multi_label(const SlabOfCells& slab, const MultiLabelCell& cell, std::size_t first_corner) {
        const CellPattern& pattern = *cell.pattern;
        to_physical_.set_row(cell.index[1], cell.index[2]);
        std::array<NetPoint, CellPattern::kMaxLabelPoints> positions;
        for (std::size_t p = 0; p < pattern.positions.size(); ++p) {
            const bool relaxed = p == 0 && !net_.points.empty();
            const NetPoint& point = relaxed ? net_.points[cell.id] : pattern.positions[p];
            to_physical_.add_centre(cell.index[0], to_physical_.vector_to(point), positions[p]);
        }
        std::array<std::uint32_t, CellPattern::kMaxLabelPoints> points;
        for (std::size_t p = 0; p < pattern.label_points.size(); ++p) {
            const CellPattern::LabelPoint& point = pattern.label_points[p];
            const std::size_t net_point =
                point.position == 0 ? cell.id : net_.extra_point(slab, cell, point.position);
            points[p] =
                writers_[cell.index_of_label[point.label]].write(positions[point.position], net_point);
        }
        net_.corners[cell.id] = {
            {}, {static_cast<std::uint32_t>(first_corner), pattern.crossed_edges}, {0, 0}, {}};
        for (const CellPattern::Corner& from : pattern.corners) {
            const LabelPair labels{cell.index_of_label[from.label[0]], cell.index_of_label[from.label[1]]};
            const std::size_t lesser = labels.lower < labels.upper ? 0 : 1;
            net_.corners[first_corner++] = {
                positions[pattern.label_points[from.label_point[0]].position],
                {points[from.label_point[lesser]], points[from.label_point[1 - lesser]]},
                labels,
                from.junction};
        }
    }

  private:
    SurfaceNet& net_;
    CellToPhysical to_physical_;
    PointWriter* writers_;
    std::array<NetPoint, 128>
        vector_of_case_;  // from the centre of a two-label cell to its point, not relaxed
};

void emit_points_of_slab(SurfaceNet& net, const IndexToPhysical& to_physical, std::size_t slab_number,
                         PointWriter* writers) {
    PointEmitter emitter(net, to_physical, writers);
    for (std::int64_t k = SurfaceNet::first_slice(slab_number); k < net.end_slice(slab_number); ++k) {
        for (std::int64_t j = 0; j < net.bits.cell_rows(); ++j) emitter.emit_row(j, k);
    }
    const SlabOfCells& slab = net.slabs[slab_number];
    const std::size_t first_corner = net.cell_count() + slab.first_extra_corner;
    for (const MultiLabelCell& cell : slab.multi_label_cells)
        emitter.emit_multi_label(slab, cell, first_corner + cell.first_corner);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(emit_points_of_slab);

void emit_label_points(SurfaceNet& net, const IndexToPhysical& to_physical, std::size_t slab,
                       PointWriter* writers) {
    HWY_DYNAMIC_DISPATCH(emit_points_of_slab)(net, to_physical, slab, writers);
}

}  // namespace marrow::internal
#endif
