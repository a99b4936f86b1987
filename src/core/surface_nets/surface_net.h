/// The points of a label map's surface net, and what each label's mesh has of them. Indices are those of label_borders.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "borders.h"
#include "cell_patterns.h"
#include "label_index.h"

namespace marrow::internal {

/// The labels at the ends of an edge; of a plain cell: at corner 0 and beside.
struct EndPlaces {
    Place lower, upper;

    Place lesser() const { return std::min(lower, upper); }
    Place greater() const { return std::max(lower, upper); }

    /// A complex cell's number in their stead.
    static EndPlaces from_number(std::size_t number) {
        return {static_cast<Place>(number), static_cast<Place>(number >> 16)};
    }
    std::uint32_t number() const { return lower | std::uint32_t{upper} << 16; }
};

struct ComplexCell {
    const CellPattern* pattern;
    std::array<std::int32_t, 3> index;
    std::uint32_t id;            ///< among active cells
    std::uint32_t first_corner;  ///< of CellPattern::corners, among the piece's
    std::uint32_t first_more;    ///< of CellPattern::at but the first, among the piece's
    std::array<Place, 8> place_of_label;
};

/// So many slices of cells, from first_slice on.
struct NetPiece {
    static constexpr std::int64_t kSlices = 8;

    std::vector<SurfaceShare> shares;         ///< of each label; in emit() those of the pieces before
    std::vector<std::uint64_t> halves_above;  ///< labels' half triangles that are the next piece's
    std::vector<ComplexCell> complex;
    /// Of complex cells; and where these follow in the order of all, behind the cells'.
    std::uint32_t corners = 0, more = 0, first_corner = 0, first_more = 0;
};

/// A corner of the patches of crossed edges, which the labels on both sides of them have. Of a complex cell's own: the first of
/// those that stand for it, and which edges these are for.
struct PatchCorner {
    NetPoint at;  ///< in space
    /// In the meshes of the lesser and of the greater label.
    std::array<std::uint32_t, 2> number;
    EndPlaces places;
    std::array<std::uint8_t, 4> knot;  ///< as CellPattern::Corner

    bool is_complex() const { return places.lower == places.upper; }
};

/// Points of active cells, in order of cells by (k, j, i).
struct LabelNet {
    BorderBits bits;
    std::vector<std::int64_t> values;  ///< ascending
    Buffer<std::uint8_t> shapes;       ///< of plain_cases(); 0: complex
    Buffer<EndPlaces> places;          ///< of plain cells; of complex ones their numbers in NetPiece::complex
    Buffer<NetPoint> points;           ///< of each cell the first, when relaxed
    Buffer<PatchCorner> corners;  ///< of each cell one, and behind these those of complex cells, when placed
    std::vector<NetPiece> pieces;

    const ComplexCell& complex_cell(std::int64_t k, std::uint32_t id) const {
        return piece_of_slice(k).complex[places[id].number()];
    }
    const NetPiece& piece_of_slice(std::int64_t k) const {
        return pieces[static_cast<std::size_t>(k / NetPiece::kSlices)];
    }
    std::size_t point_count() const { return places.size() + pieces.back().first_more + pieces.back().more; }
    std::size_t corner_count() const {
        return places.size() + pieces.back().first_corner + pieces.back().corners;
    }
};

/// Finds labels and points. \throw InputError more than 65535 labels; LimitError 2^32 points or more
LabelNet make_net(const LabelMap& map, const Progress& progress);

}  // namespace marrow::internal
