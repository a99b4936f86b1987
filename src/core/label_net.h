/// The points of a label map's surface net, and what each label's mesh has of them. Indices are those of label_borders.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include <marrow/buffer.h>

#include "label_borders.h"
#include "label_cell.h"
#include "label_values.h"

namespace marrow::internal {

/// The labels of an active cell: of corner 0 and beside; the same: a complex cell.
struct CellPlaces {
    Place corner, other;

    bool is_complex() const { return corner == other; }
    Place lesser() const { return std::min(corner, other); }
    Place greater() const { return std::max(corner, other); }
};

/// The numbers of a cell's point in the meshes of its lesser and of its greater label, from place_points on. Of a complex cell,
/// number[0] is its place in the piece's list.
struct alignas(8) CellNumbers {
    std::array<std::uint32_t, 2> number;
};

struct ComplexCell {
    const CellPattern* pattern;
    std::array<std::int32_t, 3> index;
    std::uint32_t id;          ///< among active cells
    std::uint32_t first_own;   ///< in NetPiece::numbers
    std::uint32_t first_more;  ///< in NetPiece::more
    std::array<Place, 8> place_of_label;
};

/// So many slices of cells, from first_slice on.
struct NetPiece {
    static constexpr std::int64_t kSlices = 8;

    struct Count {
        std::uint64_t points = 0;
        std::uint64_t quarters = 0;   ///< of a quad; see CellPattern
        std::uint64_t triangles = 0;  ///< beyond those of the quads
    };
    std::vector<Count> counts;           ///< of each label
    std::vector<Place> triangles_above;  ///< labels' triangles beyond those of quads, of the next piece
    std::vector<ComplexCell> complex;
    std::vector<std::uint32_t> numbers;  ///< as CellNumbers, of CellPattern::owns
    std::vector<NetPoint> more;          ///< the points of CellPattern::at but the first
    std::uint32_t first_more = 0;        ///< where these follow in the order of all, behind the cells'
};

/// Points of active cells, in order of cells by (k, j, i).
struct LabelNet {
    BorderBits bits;
    std::vector<std::int64_t> values;  ///< ascending
    Buffer<CellPlaces> places;
    Buffer<CellNumbers> numbers;
    Buffer<std::uint8_t> shapes;  ///< of plain_cases(); 0: complex
    Buffer<NetPoint> points;      ///< the first of each cell, when relaxed or placed
    std::vector<NetPiece> pieces;
    tbb::enumerable_thread_specific<CellPatterns> patterns;

    const ComplexCell& complex_cell(std::int64_t k, std::uint32_t id) const {
        return piece_of_slice(k).complex[numbers[id].number[0]];
    }
    const NetPiece& piece_of_slice(std::int64_t k) const {
        return pieces[static_cast<std::size_t>(k / NetPiece::kSlices)];
    }
    std::size_t point_count() const {
        return places.size() + pieces.back().first_more + pieces.back().more.size();
    }
};

/// Finds labels and points. \throw InputError more than 65535 labels; LimitError 2^32 points or more
LabelNet make_net(const LabelMap& map, const Progress& progress);

}  // namespace marrow::internal
