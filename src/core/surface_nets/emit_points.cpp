#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/emit_points.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "writers.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Takes points of cells into space. The cells' middles are in double precision; no fused operations, so that the numbers are the
// same on every processor.
class CellFrame {
  public:
    explicit CellFrame(const IndexToPhysical& frame) {
        for (std::size_t r = 0; r < 3; ++r) {
            // The middle of cell (0, 1/2, 1/2); the first corner of (0, 0, 0) is sample (-1, -1, -1) of the volume.
            first_[r] = frame.origin[r] - 0.5 * frame.exact[r][0];
            for (std::size_t a = 0; a < 3; ++a) {
                along_[a][r] = frame.exact[r][a];
                axes_[a][r] = frame.matrix[r][a];
            }
        }
    }
    HWY_INLINE void move_to_row(std::int64_t j, std::int64_t k) {
        const auto y = hn::Set(kDouble, static_cast<double>(j) - 0.5),
                   z = hn::Set(kDouble, static_cast<double>(k) - 0.5);
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kDouble)) {
            const auto along_y = hn::Mul(hn::Load(kDouble, along_[1] + r), y),
                       along_z = hn::Mul(hn::Load(kDouble, along_[2] + r), z);
            hn::Store(hn::Add(hn::Add(hn::Load(kDouble, first_ + r), along_y), along_z), kDouble, row_ + r);
        }
    }
    /// From the cell's middle, in space.
    HWY_INLINE NetPoint about_middle(const NetPoint& point) const {
        NetPoint result;
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kFloat)) {
            auto about = hn::Mul(hn::Load(kFloat, axes_[0] + r), hn::Set(kFloat, point.at[0]));
            for (std::size_t a = 1; a < 3; ++a)
                about = hn::Add(about, hn::Mul(hn::Load(kFloat, axes_[a] + r), hn::Set(kFloat, point.at[a])));
            hn::Store(about, kFloat, result.at + r);
        }
        return result;
    }
    /// Of cell i of the row.
    HWY_INLINE void place(std::int64_t i, const NetPoint& about, NetPoint& point) const {
        const auto x = hn::Set(kDouble, static_cast<double>(i));
        for (std::size_t r = 0; r < 4; r += hn::Lanes(kFloat)) {
            const auto middle =
                hn::Add(hn::Load(kDouble, row_ + r), hn::Mul(hn::Load(kDouble, along_[0] + r), x));
            const auto away = hn::PromoteTo(kDouble, hn::Load(kFloat, about.at + r));
            hn::Store(hn::DemoteTo(kFloat, hn::Add(middle, away)), kFloat, point.at + r);
        }
    }

  private:
    static constexpr hn::CappedTag<double, 4> kDouble{};
    static constexpr hn::Rebind<float, hn::CappedTag<double, 4>> kFloat{};
    alignas(32) double first_[4] = {}, along_[3][4] = {}, row_[4] = {};
    alignas(16) float axes_[3][4] = {};
};

// Places a piece's points.
class PointPlacer {
  public:
    PointPlacer(LabelNet& net, const IndexToPhysical& frame, PointWriter* writers)
        : net_(net), frame_(frame), writers_(writers) {
        for (std::size_t c = 0; c < abouts_.size(); ++c)
            abouts_[c] = frame_.about_middle(plain_cases()[c].at);
    }

    void place_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        const CellRow row(bits, j, k);
        if (row.first == bits.first_of_row[bits.row_number(j, k) + 1]) return;
        frame_.move_to_row(j, k);
        // What does not change while corners are written; the compiler cannot know.
        const std::uint8_t* const shapes = net_.shapes.data();
        const EndPlaces* const all_places = net_.places.data();
        const NetPoint* const points = net_.points.empty() ? nullptr : net_.points.data();
        PatchCorner* const corners = net_.corners.data();
        PointWriter* const writers = writers_;
        for (std::size_t w = 0; w < bits.words; ++w) {
            const std::uint64_t active = row.active[w];
            const std::uint32_t first = row.first + row.before[w];
            for (std::uint64_t left = active & ~row.complex[w]; left != 0; left &= left - 1) {
                const std::uint32_t id =
                    first + static_cast<std::uint32_t>(__builtin_popcountll(active & ((left & -left) - 1)));
                const EndPlaces places = all_places[id];
                PatchCorner& corner = corners[id];
                const auto i = static_cast<std::int64_t>(64 * w) + __builtin_ctzll(left);
                if (points == nullptr)
                    frame_.place(i, abouts_[shapes[id]], corner.at);
                else
                    frame_.place(i, frame_.about_middle(points[id]), corner.at);
                corner.number[0] = writers[places.lesser()].write(corner.at);
                corner.number[1] = writers[places.greater()].write(corner.at);
                corner.places = places;
                corner.knot = {};
            }
        }
    }

    void place_complex(const ComplexCell& cell, std::uint32_t first_corner) {
        const CellPattern& pattern = *cell.pattern;
        frame_.move_to_row(cell.index[1], cell.index[2]);
        std::array<NetPoint, CellPattern::kMostOwns> at;
        for (std::size_t p = 0; p < pattern.at.size(); ++p) {
            const NetPoint& about = p == 0 && !net_.points.empty() ? net_.points[cell.id] : pattern.at[p];
            frame_.place(cell.index[0], frame_.about_middle(about), at[p]);
        }
        std::array<std::uint32_t, CellPattern::kMostOwns> numbers;
        for (std::size_t o = 0; o < pattern.owns.size(); ++o) {
            const CellPattern::Own& own = pattern.owns[o];
            numbers[o] = writers_[cell.place_of_label[own.label]].write(at[own.number]);
        }
        net_.corners[cell.id] = {{}, {first_corner, pattern.crossed}, {0, 0}, {}};
        for (const CellPattern::Corner& of : pattern.corners) {
            const EndPlaces places{cell.place_of_label[of.label[0]], cell.place_of_label[of.label[1]]};
            const std::size_t lesser = places.lower < places.upper ? 0 : 1;
            net_.corners[first_corner++] = {at[pattern.owns[of.own[0]].number],
                                            {numbers[of.own[lesser]], numbers[of.own[1 - lesser]]},
                                            places,
                                            of.knot};
        }
    }

  private:
    LabelNet& net_;
    CellFrame frame_;
    PointWriter* writers_;
    std::array<NetPoint, 128> abouts_;  // of plain cases
};

void place_points_of_piece(LabelNet& net, const IndexToPhysical& frame, std::size_t piece_number,
                           PointWriter* writers) {
    PointPlacer placer(net, frame, writers);
    const NetPiece& piece = net.pieces[piece_number];
    const std::int64_t first = static_cast<std::int64_t>(piece_number) * NetPiece::kSlices;
    for (std::int64_t k = first; k < std::min(first + NetPiece::kSlices, net.bits.dims[2] + 1); ++k) {
        for (std::int64_t j = 0; j <= net.bits.dims[1]; ++j) placer.place_row(j, k);
    }
    const auto first_corner = static_cast<std::uint32_t>(net.places.size()) + piece.first_corner;
    for (const ComplexCell& cell : piece.complex)
        placer.place_complex(cell, first_corner + cell.first_corner);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(place_points_of_piece);

void place_points(LabelNet& net, const IndexToPhysical& frame, std::size_t piece, PointWriter* writers) {
    HWY_DYNAMIC_DISPATCH(place_points_of_piece)(net, frame, piece, writers);
}

}  // namespace marrow::internal
#endif
