#include "label_cell.h"

#include <algorithm>
#include <numeric>

#include "case_table.h"

namespace marrow::internal {
namespace {

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
            for (const int e : kFaceEdges[f]) {
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

CellPatches find_patches(const std::array<std::int64_t, 8>& labels) {
    CellPatches cell;
    cell.patch_of_edge.fill(-1);
    cell.patch_of_point.fill(-1);
    for (auto& p : cell.point) p.fill(-1);
    for (auto& k : cell.knot) k.fill(-1);
    const auto label_at = [&](int e, int end) { return labels[kEdgeCorners[e][end]]; };
    unsigned mask = 0;  // of crossed edges
    for (int e = 0; e < kCellEdges; ++e) mask |= unsigned{label_at(e, 0) != label_at(e, 1)} << e;
    const auto crossed = [&](int e) { return (mask >> e & 1) != 0; };

    Sets<kCellEdges> patches;
    Sets<2 * kCellEdges> loops;  // edge e as its end's label has it is 2 e + end
    // Joins all crossed ones of some edges.
    const auto tie = [&](std::initializer_list<int> edges) {
        for (auto a = edges.begin(); a != edges.end(); ++a) {
            for (auto b = a + 1; crossed(*a) && b != edges.end(); ++b) {
                if (!crossed(*b)) continue;
                patches.join(*a, *b);
                for (int i = 0; i < 2; ++i) {
                    for (int j = 0; j < 2; ++j) {
                        if (label_at(*a, i) == label_at(*b, j)) loops.join(2 * *a + i, 2 * *b + j);
                    }
                }
            }
        }
    };
    bool two_knots = false;  // on a face
    for (std::size_t f = 0; f < 6; ++f) {
        const auto& e = kFaceEdges[f];
        std::int64_t corner[4];
        for (std::size_t i = 0; i < 4; ++i) corner[i] = labels[kFaceCorners[f][i]];
        const bool all = crossed(e[0]) && crossed(e[1]) && crossed(e[2]) && crossed(e[3]);
        const bool even = all && corner[0] == corner[2], odd = all && corner[1] == corner[3];
        if (!even && !odd) {
            tie({e[0], e[1], e[2], e[3]});
            continue;
        }
        two_knots = true;
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
                if (cell.patch_of_edge[static_cast<std::size_t>(other)] != patch) continue;
                for (int side = 0; side < 2; ++side) taken |= label_at(other, side) == label_at(e, end);
            }
            point = taken ? static_cast<std::int8_t>(cell.points++) : patch;
            if (taken) cell.patch_of_point[static_cast<std::size_t>(point)] = patch;
        }
    }
    cell.simple = cell.points == 1 && !two_knots;
    return cell;
}

// The patches of cells with two labels, indexed by which corners (bit v: corner v) have the larger one.
const std::array<CellPatches, 256>& patches_of_two() {
    static const auto table = [] {
        std::array<CellPatches, 256> patches;
        for (unsigned mask = 0; mask < patches.size(); ++mask) {
            std::array<std::int64_t, 8> labels;
            for (std::size_t v = 0; v < 8; ++v) labels[v] = mask >> v & 1;
            patches[mask] = find_patches(labels);
        }
        return patches;
    }();
    return table;
}

}  // namespace

const std::array<CrossedCell, 4096>& crossed_cells() {
    static const std::array<CrossedCell, 4096> table = make_table();
    return table;
}

CellPatches patches_of(const std::array<std::int64_t, 8>& labels) {
    const auto [smaller, larger] = std::minmax_element(labels.begin(), labels.end());
    unsigned mask = 0;
    bool two = true;
    for (std::size_t v = 0; v < 8; ++v) {
        mask |= unsigned{labels[v] == *larger} << v;
        two &= labels[v] == *larger || labels[v] == *smaller;
    }
    return two ? patches_of_two()[mask] : find_patches(labels);
}

}  // namespace marrow::internal
