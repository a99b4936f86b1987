#include "cell_patterns.h"

#include <algorithm>
#include <initializer_list>
#include <numeric>

#include <tbb/concurrent_unordered_map.h>

namespace marrow::internal {
namespace {

// For each face its edges; edge i runs from its corner i to corner i + 1.
constexpr std::array<std::array<int, 4>, 6> kFaceEdges = [] {
    std::array<std::array<int, 4>, 6> result{};
    for (std::size_t f = 0; f < 6; ++f) {
        for (std::size_t i = 0; i < 4; ++i)
            result[f][i] = edge_between(kFaceCorners[f][i], kFaceCorners[f][(i + 1) % 4]);
    }
    return result;
}();

// The patches of a cell by its labels.
struct CellPatches {
    int patches = 0;
    std::array<std::int8_t, kCellEdges> patch_of_edge;  // -1: not crossed
    // Where the edges of one label make several loops in a patch, those beyond the first have a point of their own at the same
    // place: for each edge and its two ends the point, counted on behind the patches.
    std::array<std::array<std::int8_t, 2>, kCellEdges> point;
    int points = 0;  // patches and such points
    std::array<std::int8_t, 2 * kCellEdges> patch_of_point;
    // The knot of each edge on each face, 0 or 1; -1 where the face has but one.
    std::array<std::array<std::int8_t, kCellEdges>, 6> knot;
    bool two_knots = false;  // on a face
};

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

CellPatches find_patches(const CellCorners& corners) {
    const auto& labels = corners.first;
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
    for (std::size_t f = 0; f < 6; ++f) {
        const auto& e = kFaceEdges[f];
        std::uint8_t corner[4];
        for (std::size_t i = 0; i < 4; ++i) corner[i] = labels[kFaceCorners[f][i]];
        const bool all = crossed(e[0]) && crossed(e[1]) && crossed(e[2]) && crossed(e[3]);
        const bool even = all && corner[0] == corner[2], odd = all && corner[1] == corner[3];
        if (!even && !odd) {
            tie({e[0], e[1], e[2], e[3]});
            continue;
        }
        cell.two_knots = true;
        // Corners 0 and 2 connect where they alone are alike, or are the smaller; then the knots are round corners 1 and 3.
        const bool round_odd = even && (!odd || (corners.faces >> f & 1) != 0);
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
    return cell;
}

// The mean of some edges' middles, about the middle of the cell.
template <class Has>
NetPoint mean_of_edges(const Has& has) {
    NetPoint sum{};
    float count = 0;
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if (!has(e)) continue;
        for (std::size_t a = 0; a < 3; ++a)
            sum.at[a] +=
                0.5f * static_cast<float>((kEdgeCorners[e][0] >> a & 1) + (kEdgeCorners[e][1] >> a & 1));
        ++count;
    }
    for (std::size_t a = 0; a < 3; ++a) sum.at[a] = sum.at[a] / count - 0.5f;
    return sum;
}

std::uint64_t half_triangles_of(const CellCorners& corners, std::uint8_t label) {
    std::uint64_t halves = 0;
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if ((corners.first[kEdgeCorners[e][0]] == label) == (corners.first[kEdgeCorners[e][1]] == label))
            continue;
        const bool along_z = kEdgeCorners[e][1] - kEdgeCorners[e][0] == 4;
        halves += along_z ? 1 : edge_slice(e) == 0 ? 2 : 0;
    }
    return halves;
}

// Every bit of it depends on every bit of the key.
std::uint32_t hash_of(std::uint32_t key) {
    return static_cast<std::uint32_t>(key * 0x9e3779b97f4a7c15u >> 32);
}

struct KeyHash {
    std::size_t operator()(std::uint32_t key) const { return hash_of(key); }
};

}  // namespace

CellPattern::CellPattern(const CellCorners& corners_of_cell) {
    const CellPatches cell = find_patches(corners_of_cell);
    const auto& first = corners_of_cell.first;
    std::array<std::uint8_t, 8> label{};  // of each corner
    for (std::uint8_t v = 0; v < 8; ++v) {
        label[v] = label[first[v]];
        if (first[v] != v) continue;
        label[v] = static_cast<std::uint8_t>(labels.size());
        labels.push_back({v, {0, half_triangles_of(corners_of_cell, v)}});
    }
    for (int p = 0; p < cell.points; ++p) {
        const std::int8_t patch = cell.patch_of_point[static_cast<std::size_t>(p)];
        at.push_back(mean_of_edges([&](std::size_t e) { return cell.patch_of_edge[e] == patch; }));
    }
    // The number of a label's own point, which is a new one where there is none of that number.
    const auto own = [&](std::size_t number, std::uint8_t whose) {
        const auto same = [&](const Own& o) { return o.number == number && o.label == whose; };
        const auto found = std::find_if(owns.begin(), owns.end(), same);
        const auto place = static_cast<std::uint8_t>(found - owns.begin());
        if (found == owns.end()) {
            owns.push_back({whose, static_cast<std::uint8_t>(number)});
            ++labels[whose].share.points;
        }
        return place;
    };
    const auto add_corner = [&](std::size_t e, std::size_t lower_number, std::size_t upper_number) {
        const std::array<std::uint8_t, 2> ends{label[kEdgeCorners[e][0]], label[kEdgeCorners[e][1]]};
        const std::uint8_t lower = own(lower_number, ends[0]), upper = own(upper_number, ends[1]);
        corners.push_back({ends, {lower, upper}, {}});
    };
    std::array<std::size_t, kCellEdges> corner_of_edge{};
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if (cell.patch_of_edge[e] < 0) continue;
        crossed = static_cast<std::uint16_t>(crossed | 1u << e);
        corner_of_edge[e] = corners.size();
        add_corner(e, static_cast<std::size_t>(cell.point[e][0]), static_cast<std::size_t>(cell.point[e][1]));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& knots = cell.knot[2 * axis];
        if (std::none_of(knots.begin(), knots.end(), [](int k) { return k >= 0; })) continue;
        const std::size_t first_knot = at.size();
        for (std::int8_t knot = 0; knot < 2; ++knot)
            at.push_back(mean_of_edges([&](std::size_t e) { return knots[e] == knot; }));
        for (std::size_t e = 0; e < kCellEdges; ++e) {
            if (knots[e] < 0) continue;
            const std::size_t number = first_knot + static_cast<std::size_t>(knots[e]);
            corners[corner_of_edge[e]].knot[axis] =
                static_cast<std::uint8_t>(corners.size() - corner_of_edge[e]);
            add_corner(e, number, number);
            // Both patches have a triangle more.
            for (const std::uint8_t whose : corners.back().label)
                (edge_slice(e) == 0 ? labels[whose].share.half_triangles
                                    : labels[whose].half_triangles_above) += 2;
        }
    }
    std::uint8_t faces = 0, junctions = 0;
    for (std::size_t f = 0; f < 6; ++f) {
        point_of_face[f] = kNone;
        int count = 0;
        for (const int edge : kFaceEdges[f]) {
            const auto e = static_cast<std::size_t>(edge);
            if (cell.patch_of_edge[e] < 0) continue;
            point_of_face[f] = cell.patch_of_edge[e];
            ++count;
        }
        faces = static_cast<std::uint8_t>(faces | unsigned{count > 0} << f);
        junctions = static_cast<std::uint8_t>(junctions | unsigned{count > 2} << f);
    }
    // A point alone in its cell moves; on a line where three labels or more meet, along that line only.
    if (cell.points == 1 && !cell.two_knots) joined = (junctions & (junctions - 1)) != 0 ? junctions : faces;
}

const CellPattern& CellPatterns::of(const CellCorners& corners) {
    static tbb::concurrent_unordered_map<std::uint32_t, CellPattern, KeyHash> all;
    const std::uint32_t key = corners.key();
    Known& known = known_[hash_of(key) % known_.size()];
    if (known.pattern == nullptr || known.key != key) {
        auto found = all.find(key);
        if (found == all.end()) found = all.emplace(key, corners).first;
        known = {key, &found->second};
    }
    return *known.pattern;
}

const std::array<PlainCase, 128>& plain_cases() {
    static const auto table = [] {
        std::array<PlainCase, 128> cases{};
        for (unsigned c = 1; c < cases.size(); ++c) {
            std::array<int, 8> labels;
            for (std::size_t v = 0; v < 8; ++v) labels[v] = static_cast<int>(2 * c >> v & 1);
            const CellPattern pattern{CellCorners(labels)};
            cases[c] = {pattern.at[0], pattern.labels[0].share, pattern.joined};
        }
        return cases;
    }();
    return table;
}

}  // namespace marrow::internal
