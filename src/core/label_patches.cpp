#include "label_patches.h"

#include <algorithm>

#include "label_cell.h"

namespace marrow::internal {
namespace {

// Grid edges along an axis.
struct EdgeKind {
    std::array<std::size_t, 4> local_edge{};  // what the edge is to each cell round it
    std::array<std::size_t, 4> upper{};       // whether that is of the upper slice
};

constexpr std::array<EdgeKind, 3> kEdgeKinds = [] {
    constexpr int kRing[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
    std::array<EdgeKind, 3> kinds;
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (std::size_t c = 0; c < 4; ++c) {
            EdgeKind& kind = kinds[static_cast<std::size_t>(axis)];
            const int corner = (kRing[c][0] < 0 ? 1 << u : 0) | (kRing[c][1] < 0 ? 1 << v : 0);
            kind.local_edge[c] = static_cast<std::size_t>(edge_between(corner, corner | 1 << axis));
            kind.upper[c] = axis == 2 || (corner >> 2 & 1) == 0 ? 1 : 0;
        }
    }
    return kinds;
}();

}  // namespace

void ComplexPatches::add(std::size_t axis, const EdgeCells& round) {
    const EdgeKind& kind = kEdgeKinds[axis];
    std::array<const ComplexCell*, 4> cells{};
    for (std::size_t c = 0; c < 4; ++c) {
        if (net_.places[round[c]].is_complex())
            cells[c] = &pieces_[kind.upper[c]]->complex[net_.numbers[round[c]].number[0]];
    }
    const auto place_at = [&](std::size_t end) {
        if (const ComplexCell* cell = cells[2]; cell != nullptr)
            return cell->place_of_label[cell->pattern->label[end == 0 ? 0 : std::size_t{1} << axis]];
        return end == 0 ? net_.places[round[2]].corner : net_.places[round[2]].other;
    };
    const auto number_of = [&](std::size_t c, std::int8_t own) {
        return pieces_[kind.upper[c]]->numbers[cells[c]->first_own + static_cast<std::size_t>(own)];
    };
    const std::array<Place, 2> places{place_at(0), place_at(1)};
    const auto corner_of = [&](std::size_t c, std::size_t end) {
        if (cells[c] != nullptr) return number_of(c, cells[c]->pattern->own_of_edge[kind.local_edge[c]][end]);
        return net_.numbers[round[c]].number[places[end] != net_.places[round[c]].lesser() ? 1 : 0];
    };
    const auto is_single = [](const ComplexCell* cell) { return cell == nullptr || cell->pattern->single; };
    if (std::all_of(cells.begin(), cells.end(), is_single)) {
        const std::size_t from = first_diagonal_is_shorter(net_.points[round[0]], net_.points[round[1]],
                                                           net_.points[round[2]], net_.points[round[3]])
                                     ? 0
                                     : 1;
        std::array<Corners, 2> quads;
        for (std::size_t c = 0; c < 4; ++c) {
            for (std::size_t end = 0; end < 2; ++end) quads[end][c] = corner_of((c + from) % 4, end);
        }
        const std::size_t straight = mirrored_ ? 1 : 0;
        writers_[places[straight]].add(quads[straight]);
        writers_[places[1 - straight]].add_turned(quads[1 - straight]);
        return;
    }
    for (std::size_t end = 0; end < 2; ++end) {
        TriangleWriter& writer = writers_[places[end]];
        if (writer.step == 0) continue;
        std::array<const NetPoint*, 4> at;
        for (std::size_t c = 0; c < 4; ++c) {
            at[c] = &net_.points[round[c]];
            if (cells[c] == nullptr) continue;
            const CellPattern& pattern = *cells[c]->pattern;
            const std::int8_t own = pattern.own_of_edge[kind.local_edge[c]][end];
            const std::size_t number = pattern.owns[static_cast<std::size_t>(own)].number;
            if (number != 0) at[c] = &pieces_[kind.upper[c]]->more[cells[c]->first_more + number - 1];
        }
        // The polygon: corners, and between some of them knots. The face between a cell and the next is the lower one of
        // whichever lies higher.
        constexpr std::size_t kHigher[4] = {1, 2, 2, 3};
        const std::size_t across[2] = {(axis + 1) % 3, (axis + 2) % 3};
        std::array<std::uint32_t, 8> polygon{};
        std::size_t size = 0, from = polygon.size();
        for (std::size_t c = 0; c < 4; ++c) {
            polygon[size++] = corner_of(c, end);
            const std::size_t higher = kHigher[c];
            if (cells[higher] == nullptr) continue;
            const std::int8_t knot =
                cells[higher]->pattern->own_of_knot[across[c % 2]][kind.local_edge[higher]][end];
            if (knot == CellPattern::kNone) continue;
            from = std::min(from, size);
            polygon[size++] = number_of(higher, knot);
        }
        // As a fan: from an end of the shorter diagonal; with knots from the first of these, as a diagonal beside it could be
        // another patch's too: the face has two knots.
        if (size == 4) from = first_diagonal_is_shorter(*at[0], *at[1], *at[2], *at[3]) ? 0 : 1;
        const auto next = [&](std::size_t n) { return n + 1 < size ? n + 1 : 0; };
        for (std::size_t n = next(from); next(n) != from; n = next(n)) {
            const std::uint32_t b = polygon[n], c = polygon[next(n)];
            if ((end == 1) != mirrored_)
                writer.add(polygon[from], c, b);
            else
                writer.add(polygon[from], b, c);
        }
    }
}

}  // namespace marrow::internal
