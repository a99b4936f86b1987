#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/surface_net.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "surface_net.h"

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
    CellMaker(const LabelMap& map, LabelNet& net, NetPiece& piece, CellPatterns& patterns)
        : labels_(map),
          outside_(static_cast<std::size_t>(map.dims[0]), labels_.background),
          bits_(net.bits),
          shapes_(net.shapes.data()),
          places_(net.places.data()),
          piece_(piece),
          place_(net.values),
          patterns_(patterns) {
        piece.shares.resize(net.values.size());
        piece.halves_above.resize(net.values.size());
        shares_ = piece.shares.data();
    }

    void make_row(std::int64_t j, std::int64_t k) {
        for (std::size_t v = 0; v < 8; ++v) {
            const T* samples =
                labels_.row(j + static_cast<std::int64_t>(v >> 1 & 1), k + static_cast<std::int64_t>(v >> 2));
            corner_rows_[v] = (samples != nullptr ? samples : outside_.data()) + (v & 1);
        }
        const std::size_t row = bits_.row(j, k), last = static_cast<std::size_t>(bits_.dims[0]);
        std::uint32_t id = bits_.first_of_row[bits_.row_number(j, k)];
        for (std::size_t w = 0; w < bits_.words; ++w) {
            const std::uint64_t active = bits_.active[row + w], complex = bits_.complex[row + w];
            if (active == 0) continue;
            prefetch_next_row(w);
            const PlainCorners corners(CrossedEdges<std::uint64_t>(bits_, j, k, w).edges);
            // Those with corners beyond the map's ends.
            const std::uint64_t ends =
                (w == 0 ? 1 : 0) | (w == last / 64 ? std::uint64_t{1} << last % 64 : 0);
            for (std::uint64_t left = active; left != 0; left &= left - 1, ++id) {
                const std::uint64_t bit = left & -left;
                const std::size_t i = 64 * w + static_cast<std::size_t>(__builtin_ctzll(left));
                const unsigned shape = corners.of(bit);
                if ((bit & (complex | ends)) == 0)
                    make_plain(id, shape, [&](std::size_t v) { return place_(corner_rows_[v][i - 1]); });
                else if ((bit & complex) == 0)
                    make_plain(id, shape, [&](std::size_t v) { return place_of_corner(i, v); });
                else
                    make_complex(id, {static_cast<std::int64_t>(i), j, k});
            }
        }
    }

  private:
    // Where cells are active they are likely to be in the row after, too, of whose samples one row was not read for a while.
    HWY_INLINE void prefetch_next_row(std::size_t w) const {
        const auto next = reinterpret_cast<std::uintptr_t>(corner_rows_[6]) +
                          sizeof(T) * (64 * w + static_cast<std::size_t>(bits_.dims[0]));
        for (std::size_t at = 0; at < 64 * sizeof(T); at += 64)
            __builtin_prefetch(reinterpret_cast<const void*>(next + at));
    }

    Place place_of_corner(std::size_t i, std::size_t v) {
        const std::size_t sample = i + (v & 1);
        const bool within = sample >= 1 && sample <= static_cast<std::size_t>(bits_.dims[0]);
        return place_(within ? corner_rows_[v][i - 1] : labels_.background);
    }

    template <class PlaceOf>
    HWY_INLINE void make_plain(std::uint32_t id, unsigned shape, const PlaceOf& place_of) {
        const EndPlaces places{place_of(0), place_of(static_cast<std::size_t>(__builtin_ctz(shape)))};
        const SurfaceShare share = cases_[shape >> 1].share;
        shapes_[id] = static_cast<std::uint8_t>(shape >> 1);
        places_[id] = places;
        shares_[places.lower] += share;
        shares_[places.upper] += share;
    }

    HWY_NOINLINE void make_complex(std::uint32_t id, const Index3& index) {
        std::array<Place, 8> places;
        for (std::size_t v = 0; v < 8; ++v)
            places[v] = place_of_corner(static_cast<std::size_t>(index[0]), v);
        const CellPattern& pattern = patterns_.of(CellCorners(places));
        shapes_[id] = 0;
        places_[id] = EndPlaces::from_number(piece_.complex.size());
        ComplexCell& cell = piece_.complex.emplace_back();
        cell.pattern = &pattern;
        for (std::size_t a = 0; a < 3; ++a) cell.index[a] = static_cast<std::int32_t>(index[a]);
        cell.id = id;
        cell.first_corner = piece_.corners;
        cell.first_more = piece_.more;
        piece_.corners += static_cast<std::uint32_t>(pattern.corners.size());
        piece_.more += static_cast<std::uint32_t>(pattern.at.size() - 1);
        const bool last = (index[2] + 1) % NetPiece::kSlices == 0;
        for (std::size_t l = 0; l < pattern.labels.size(); ++l) {
            const CellPattern::Label& label = pattern.labels[l];
            const Place place = cell.place_of_label[l] = places[label.corner];
            shares_[place] += label.share;
            (last ? piece_.halves_above[place] : shares_[place].half_triangles) += label.half_triangles_above;
        }
    }

    const LabelReader<T> labels_;
    const std::vector<T> outside_;
    const BorderBits& bits_;
    std::uint8_t* const shapes_;
    EndPlaces* const places_;
    NetPiece& piece_;
    SurfaceShare* shares_;
    Places<T> place_;
    CellPatterns& patterns_;
    const PlainCase* const cases_ = plain_cases().data();
    // By corner its row, from sample 1 on or, of corners with the higher x, from sample 2.
    std::array<const T*, 8> corner_rows_{};
};

void make_piece(const LabelMap& map, LabelNet& net, std::size_t number, CellPatterns& patterns) {
    visit_sample_type(map.type, [&](auto sample) {
        CellMaker<decltype(sample)> maker(map, net, net.pieces[number], patterns);
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

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace marrow::internal {

HWY_EXPORT(make_piece);

LabelNet make_net(const LabelMap& map, const Progress& progress) {
    const auto slices = static_cast<std::size_t>(map.dims[2] + 1);
    const std::size_t pieces = (slices + NetPiece::kSlices - 1) / NetPiece::kSlices;
    Stage borders(progress, 0, 0.15, slices);
    LabelNet net{find_borders(map, borders), {}, {}, {}, {}, {}, std::vector<NetPiece>(pieces)};
    net.values = find_values(map, net.bits);
    net.places.resize(net.bits.cells());
    net.shapes.resize(net.bits.cells());
    Stage stage(progress, 0.15, 0.3, pieces);
    tbb::enumerable_thread_specific<CellPatterns> patterns;
    tbb::parallel_for(std::size_t{0}, pieces, [&](std::size_t number) {
        HWY_DYNAMIC_DISPATCH(make_piece)(map, net, number, patterns.local());
        stage.step();
    });
    std::uint64_t corners = net.places.size(), more = 0;
    for (std::size_t p = 0; p < pieces; ++p) {
        NetPiece& piece = net.pieces[p];
        for (std::size_t place = 0; p > 0 && place < net.values.size(); ++place)
            piece.shares[place].half_triangles += net.pieces[p - 1].halves_above[place];
        piece.first_corner = static_cast<std::uint32_t>(corners - net.places.size());
        piece.first_more = static_cast<std::uint32_t>(more);
        corners += piece.corners;
        more += piece.more;
        // No cell has more points than corners.
        if (corners >= std::numeric_limits<std::uint32_t>::max()) throw_too_many_label_points(corners);
    }
    return net;
}

}  // namespace marrow::internal
#endif
