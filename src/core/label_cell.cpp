#include "label_cell.h"

#include <algorithm>
#include <numeric>

#include "case_table.h"

namespace marrow::internal {
namespace {

// The edge between two corners.
int edge_between(int a, int b) {
    for (int e = 0; e < kCellEdges; ++e) {
        if (kEdgeCorners[e][0] == std::min(a, b) && kEdgeCorners[e][1] == std::max(a, b)) return e;
    }
    return -1;
}

// For each face its edges; edge i runs from its corner i to corner i + 1.
const std::array<std::array<int, 4>, 6>& face_edges() {
    static const auto edges = [] {
        std::array<std::array<int, 4>, 6> result{};
        for (std::size_t f = 0; f < 6; ++f) {
            for (std::size_t i = 0; i < 4; ++i)
                result[f][i] = edge_between(kFaceCorners[f][i], kFaceCorners[f][(i + 1) % 4]);
        }
        return result;
    }();
    return edges;
}

// Few things that join to sets.
template <std::size_t kSize>
class Sets {
  public:
    Sets() { std::iota(parent_.begin(), parent_.end(), 0); }
    int root(int i) const {
        while (parent_[static_cast<std::size_t>(i)] != i) i = parent_[static_cast<std::size_t>(i)];
        return i;
    }
    void join(int a, int b) {
        const int ra = root(a), rb = root(b);
        parent_[static_cast<std::size_t>(std::max(ra, rb))] = std::min(ra, rb);
    }

  private:
    std::array<int, kSize> parent_;
};

std::array<CrossedCell, 4096> make_table() {
    std::array<CrossedCell, 4096> table;
    for (unsigned mask = 0; mask < table.size(); ++mask) {
        CrossedCell& cell = table[mask];
        const auto crossed = [&](int e) { return (mask >> e & 1) != 0; };
        Sets<kCellEdges> sets;
        bool four_on_a_face = false;
        for (std::size_t f = 0; f < 6; ++f) {
            int count = 0, first = -1;
            for (const int e : face_edges()[f]) {
                if (!crossed(e)) continue;
                ++count;
                if (first < 0) first = e;
                sets.join(first, e);
            }
            if (count > 0) cell.faces = static_cast<std::uint8_t>(cell.faces | 1u << f);
            if (count > 2) cell.junctions = static_cast<std::uint8_t>(cell.junctions | 1u << f);
            four_on_a_face |= count == 4;
        }
        // A corner and its antipode that differ from all neighbours: a label may have two loops, or there are two patches.
        bool antipodes = false;
        for (int v = 0; v < 4; ++v) {
            bool alone = true;
            for (const int axis : {1, 2, 4}) {
                alone &= crossed(edge_between(v, v ^ axis));
                alone &= crossed(edge_between(7 - v, (7 - v) ^ axis));
            }
            antipodes |= alone;
        }
        int edges = 0, patches = 0;
        for (int e = 0; e < kCellEdges; ++e) {
            if (!crossed(e)) continue;
            ++edges;
            patches += sets.root(e) == e;
            for (std::size_t a = 0; a < 3; ++a)
                cell.centre[a] +=
                    0.5f * static_cast<float>((kEdgeCorners[e][0] >> a & 1) + (kEdgeCorners[e][1] >> a & 1));
        }
        for (float& c : cell.centre) c /= static_cast<float>(std::max(edges, 1));
        cell.simple = patches == 1 && !four_on_a_face && !antipodes;
    }
    return table;
}

}  // namespace

const std::array<CrossedCell, 4096>& crossed_cells() {
    static const std::array<CrossedCell, 4096> table = make_table();
    return table;
}

bool CellPatches::simple() const {
    if (points != 1) return false;
    for (const auto& face : knot) {
        for (const std::int8_t k : face) {
            if (k >= 0) return false;
        }
    }
    return true;
}

CellPatches patches_of(const std::array<std::int64_t, 8>& labels) {
    CellPatches cell;
    cell.patch_of_edge.fill(-1);
    cell.patch_of_point.fill(-1);
    for (auto& p : cell.point) p.fill(-1);
    for (auto& k : cell.knot) k.fill(-1);
    const auto label_at = [&](int e, int end) { return labels[kEdgeCorners[e][end]]; };
    const auto crossed = [&](int e) { return label_at(e, 0) != label_at(e, 1); };

    Sets<kCellEdges> patches;
    Sets<2 * kCellEdges> loops;  // edge e as its end's label has it is 2 e + end
    // Joins all crossed ones of some edges.
    const auto tie = [&](std::initializer_list<int> edges) {
        for (const int a : edges) {
            for (const int b : edges) {
                if (!crossed(a) || !crossed(b)) continue;
                patches.join(a, b);
                for (int i = 0; i < 2; ++i) {
                    for (int j = 0; j < 2; ++j) {
                        if (label_at(a, i) == label_at(b, j)) loops.join(2 * a + i, 2 * b + j);
                    }
                }
            }
        }
    };
    for (std::size_t f = 0; f < 6; ++f) {
        const auto& e = face_edges()[f];
        std::int64_t corner[4];
        for (std::size_t i = 0; i < 4; ++i) corner[i] = labels[kFaceCorners[f][i]];
        const bool all = crossed(e[0]) && crossed(e[1]) && crossed(e[2]) && crossed(e[3]);
        const bool even = all && corner[0] == corner[2], odd = all && corner[1] == corner[3];
        if (!even && !odd) {
            tie({e[0], e[1], e[2], e[3]});
            continue;
        }
        // Corners 0 and 2 connect where they alone are alike, or are the smaller; then the knots are round corners 1 and 3.
        const bool round_odd = even && (!odd || corner[0] < corner[1]);
        const std::size_t first = round_odd ? 0 : 3;
        for (std::size_t k = 0; k < 2; ++k) {
            const int a = e[(first + 2 * k) % 4], b = e[(first + 2 * k + 1) % 4];
            tie({a, b});
            cell.knot[f][static_cast<std::size_t>(a)] = cell.knot[f][static_cast<std::size_t>(b)] =
                static_cast<std::int8_t>(k);
        }
    }

    for (int e = 0; e < kCellEdges; ++e) {
        if (!crossed(e)) continue;
        const auto i = static_cast<std::size_t>(e), root = static_cast<std::size_t>(patches.root(e));
        if (cell.patch_of_edge[root] < 0) cell.patch_of_edge[root] = static_cast<std::int8_t>(cell.patches++);
        cell.patch_of_edge[i] = cell.patch_of_edge[root];
    }
    cell.points = cell.patches;
    for (int p = 0; p < cell.patches; ++p)
        cell.patch_of_point[static_cast<std::size_t>(p)] = static_cast<std::int8_t>(p);
    for (int e = 0; e < kCellEdges; ++e) {
        for (int end = 0; crossed(e) && end < 2; ++end) {
            const int root = loops.root(2 * e + end);
            std::int8_t& point = cell.point[static_cast<std::size_t>(e)][static_cast<std::size_t>(end)];
            if (root != 2 * e + end) {
                point = cell.point[static_cast<std::size_t>(root / 2)][static_cast<std::size_t>(root % 2)];
                continue;
            }
            const std::int8_t patch = cell.patch_of_edge[static_cast<std::size_t>(e)];
            bool taken = false;  // by another loop of this label in this patch
            for (int other = 0; other < e; ++other) {
                for (int side = 0; crossed(other) && side < 2; ++side) {
                    taken |= cell.patch_of_edge[static_cast<std::size_t>(other)] == patch &&
                             label_at(other, side) == label_at(e, end);
                }
            }
            point = taken ? static_cast<std::int8_t>(cell.points++) : patch;
            if (taken) cell.patch_of_point[static_cast<std::size_t>(point)] = patch;
        }
    }
    return cell;
}

}  // namespace marrow::internal
