#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "label_net.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "dispatch.h"
#include "label_net.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Which corners of 64 plain cells have another label than corner 0, bit-sliced: bit b of differs[v] is corner v of cell b.
struct PlainCorners {
    alignas(64) std::uint64_t differs[8];

    explicit PlainCorners(const std::uint64_t (&e)[12]) {
        differs[0] = 0;
        differs[1] = e[0];
        differs[2] = e[4];
        differs[4] = e[6];
        // With two labels, a way over two crossed edges leads back to the first.
        differs[3] = e[0] ^ e[8];
        differs[5] = e[0] ^ e[10];
        differs[6] = e[4] ^ e[7];
        differs[7] = differs[3] ^ e[11];
    }
    // Of the cell at the one bit that is set: bit v: corner v.
    HWY_INLINE unsigned of(std::uint64_t bit) const {
        const hn::CappedTag<std::uint64_t, 8> d;
        const auto cell = hn::Set(d, bit);
        unsigned corners = 0;
        for (std::size_t v = 0; v < 8; v += hn::MaxLanes(d)) {
            std::uint8_t some = 0;
            hn::StoreMaskBits(d, hn::TestBit(hn::Load(d, differs + v), cell), &some);
            corners |= static_cast<unsigned>(some) << v;
        }
        return corners;
    }
};

// Makes the cells of a piece.
template <class T>
class CellMaker {
  public:
    CellMaker(const LabelMap& map, LabelNet& net, NetPiece& piece)
        : labels_(map), net_(net), piece_(piece), place_(net.values), patterns_(net.patterns.local()) {
        piece.counts.resize(net.values.size());
    }

    void make_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        const std::size_t row = bits.row(j, k);
        const std::uint32_t first = bits.first_of_row[bits.row_number(j, k)];
        for (std::size_t r = 0; r < 4; ++r)
            rows_[r] =
                labels_.row(j + static_cast<std::int64_t>(r & 1), k + static_cast<std::int64_t>(r >> 1));
        for (std::size_t w = 0; w < bits.words; ++w) {
            const std::uint64_t active = bits.active[row + w], complex = bits.complex[row + w];
            if (active == 0) continue;
            const PlainCorners corners(CrossedEdges(bits, j, k, w).edges);
            const std::uint32_t id = first + bits.before[row + w];
            const auto i = static_cast<std::int64_t>(64 * w);
            const auto id_of = [&](std::uint64_t bit) {
                return id + static_cast<std::uint32_t>(__builtin_popcountll(active & (bit - 1)));
            };
            for (std::uint64_t left = active & ~complex; left != 0; left &= left - 1) {
                const std::uint64_t bit = left & -left;
                make_plain(id_of(bit), i + __builtin_ctzll(left), corners.of(bit));
            }
            for (std::uint64_t left = complex; left != 0; left &= left - 1)
                make_complex(id_of(left & -left), {i + __builtin_ctzll(left), j, k});
        }
    }

  private:
    Place place_of_corner(std::int64_t i, unsigned v) {
        return place_(labels_.at(rows_[v >> 1], i + (v & 1)));
    }

    HWY_INLINE void make_plain(std::uint32_t id, std::int64_t i, unsigned corners) {
        const Place corner = place_of_corner(i, 0),
                    other = place_of_corner(i, static_cast<unsigned>(__builtin_ctz(corners)));
        const CellPlaces places{corner, other};
        NetPiece::Count &a = piece_.counts[places.lesser()], &b = piece_.counts[places.greater()];
        net_.shapes[id] = static_cast<std::uint8_t>(corners >> 1);
        net_.places[id] = places;
        ++a.points;
        ++b.points;
        const std::uint64_t quarters = cases_[corners >> 1].quarters;
        a.quarters += quarters;
        b.quarters += quarters;
    }

    HWY_NOINLINE void make_complex(std::uint32_t id, const Index3& index) {
        ComplexCell cell{};
        std::array<Place, 8> places;
        for (unsigned v = 0; v < 8; ++v) places[v] = place_of_corner(index[0], v);
        const CellCorners corners(places, cell.place_of_label);
        const CellPattern& pattern = patterns_.of(corners);
        cell.pattern = &pattern;
        for (std::size_t a = 0; a < 3; ++a) cell.index[a] = static_cast<std::int32_t>(index[a]);
        cell.id = id;
        cell.first_own = static_cast<std::uint32_t>(piece_.numbers.size());
        cell.first_more = static_cast<std::uint32_t>(piece_.more.size());
        net_.shapes[id] = 0;
        net_.places[id] = {0, 0};
        net_.numbers[id] = {{static_cast<std::uint32_t>(piece_.complex.size()), 0}};
        for (const CellPattern::Own& own : pattern.owns)
            ++piece_.counts[cell.place_of_label[own.label]].points;
        piece_.numbers.resize(piece_.numbers.size() + pattern.owns.size());
        piece_.more.insert(piece_.more.end(), pattern.at.begin() + 1, pattern.at.end());
        for (std::size_t l = 0; l < static_cast<std::size_t>(corners.labels); ++l)
            piece_.counts[cell.place_of_label[l]].quarters += pattern.quarters[l];
        const bool last = (index[2] + 1) % NetPiece::kSlices == 0;
        for (std::size_t slice = 0; slice < 2; ++slice) {
            for (const std::uint8_t label : pattern.knot_triangles[slice]) {
                const Place place = cell.place_of_label[label];
                if (last && slice == 1)
                    piece_.triangles_above.push_back(place);
                else
                    ++piece_.counts[place].triangles;
            }
        }
        piece_.complex.push_back(cell);
    }

    const LabelReader<T> labels_;
    LabelNet& net_;
    NetPiece& piece_;
    Places<T> place_;
    CellPatterns& patterns_;
    const std::array<PlainCase, 128>& cases_ = plain_cases();
    std::array<const T*, 4> rows_{};
};

void make_piece(const LabelMap& map, LabelNet& net, std::size_t number) {
    with_sample_type(map.type, [&](auto sample) {
        CellMaker<decltype(sample)> maker(map, net, net.pieces[number]);
        const std::int64_t first = static_cast<std::int64_t>(number) * NetPiece::kSlices;
        for (std::int64_t k = first; k < std::min(first + NetPiece::kSlices, map.dims[2] + 1); ++k) {
            for (std::int64_t j = 0; j <= map.dims[1]; ++j) {
                const std::size_t row = net.bits.row_number(j, k);
                if (net.bits.first_of_row[row] != net.bits.first_of_row[row + 1]) maker.make_row(j, k);
            }
        }
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <limits>

#include <tbb/parallel_for.h>

namespace marrow::internal {

HWY_EXPORT(make_piece);

LabelNet make_net(const LabelMap& map, const Progress& progress) {
    const auto slices = static_cast<std::size_t>(map.dims[2] + 1);
    const std::size_t pieces = (slices + NetPiece::kSlices - 1) / NetPiece::kSlices;
    Stage borders(progress, 0, 0.15, slices);
    LabelNet net{find_borders(map, borders), {}, {}, {}, {}, {}, std::vector<NetPiece>(pieces), {}};
    net.values = find_values(map, net.bits);
    net.places.resize(net.bits.cells());
    net.numbers.resize(net.bits.cells());
    net.shapes.resize(net.bits.cells());
    Stage stage(progress, 0.15, 0.3, pieces);
    tbb::parallel_for(std::size_t{0}, pieces, [&](std::size_t number) {
        HWY_DYNAMIC_DISPATCH(make_piece)(map, net, number);
        stage.step();
    });
    std::uint64_t points = net.places.size();
    for (std::size_t p = 0; p < pieces; ++p) {
        NetPiece& piece = net.pieces[p];
        for (const Place place : piece.triangles_above) ++net.pieces[p + 1].counts[place].triangles;
        piece.first_more = static_cast<std::uint32_t>(points - net.places.size());
        points += piece.more.size();
        if (points >= std::numeric_limits<std::uint32_t>::max()) throw_too_many_label_points(points);
    }
    return net;
}

}  // namespace marrow::internal
#endif
