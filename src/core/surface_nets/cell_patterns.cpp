// Derives the shape of the surfaces in a cell from the labels of its corners.
#include "cell_patterns.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/parallel.h"

namespace marrow::internal {
namespace {

constexpr std::uint8_t kNone = CellPattern::kNone;

// A set of edges: bit e is edge e.
using EdgeSet = std::uint16_t;

constexpr EdgeSet set_of(std::size_t e) {
    return static_cast<EdgeSet>(1u << e);
}
constexpr bool contains(EdgeSet edges, std::size_t e) {
    return (edges >> e & 1) != 0;
}

// Calls f with each edge, in ascending order.
template <class F>
void for_each_edge(EdgeSet edges, const F& f) {
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if (contains(edges, e)) f(e);
    }
}

// The first corner with the label at an end of an edge, which stands for the label.
std::uint8_t label_at(const CellCorners& corners, std::size_t e, std::size_t end) {
    return corners.first[kEdgeCorners[e][end]];
}

// The junctions of a face, as sets of the crossed edges that they connect. A face with one junction has it
// first, and a face without crossed edges has none.
using FaceJunctions = std::array<EdgeSet, 2>;

FaceJunctions find_junctions(const CellCorners& corners, std::size_t face) {
    const auto corner = [&](std::size_t i) { return kFaceCorners[face][i % 4]; };
    const auto label = [&](std::size_t i) { return corners.first[corner(i)]; };
    // The edge from corner i to the next one, if it is crossed.
    const auto edge = [&](std::size_t i) {
        if (label(i) == label(i + 1)) return EdgeSet{0};
        return set_of(static_cast<std::size_t>(edge_between(corner(i), corner(i + 1))));
    };
    // The two edges at corner i.
    const auto edges_at = [&](std::size_t i) { return static_cast<EdgeSet>(edge(i + 3) | edge(i)); };

    const auto all = static_cast<EdgeSet>(edges_at(0) | edges_at(2));
    const bool all_crossed = std::popcount(all) == 4;
    const bool equal_0_2 = all_crossed && label(0) == label(2),
               equal_1_3 = all_crossed && label(1) == label(3);
    if (!equal_0_2 && !equal_1_3) return {all, 0};
    const bool connect_0_2 = equal_0_2 && (!equal_1_3 || (corners.first_is_smaller >> face & 1) != 0);
    const std::size_t separate = connect_0_2 ? 1 : 0;
    return {edges_at(separate), edges_at(separate + 2)};
}

// The components of the border within a cell, and their points.
//
// At a junction, each label has two ends of edges or none. So the ends that junctions connect form loops.
// Each loop of a label is a disk of the label's surface, around one point.
class CellBorder {
  public:
    explicit CellBorder(const CellCorners& corners);

    EdgeSet crossed = 0;
    std::array<FaceJunctions, 6> junctions;  // by face
    std::array<std::uint8_t, kCellEdges> component_of_edge;
    // For each point, the edges of its component. Each component has a point first; further points follow.
    std::vector<EdgeSet> edges_of_point;
    // For each edge, the points of the labels at its ends.
    std::array<std::array<std::uint8_t, 2>, kCellEdges> point_of_end;

  private:
    // Edges, and ends of edges (end i of edge e is 2 e + i). The lowest number of a set represents it.
    std::array<std::uint8_t, kCellEdges> component_sets_;
    std::array<std::uint8_t, 2 * kCellEdges> loop_sets_;

    void unite_junction(const CellCorners& corners, EdgeSet junction);
    void number_components();
    void number_loops(const CellCorners& corners);
    bool has_loop_before(const CellCorners& corners, std::size_t e, std::size_t end) const;
};

CellBorder::CellBorder(const CellCorners& corners) {
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if (label_at(corners, e, 0) != label_at(corners, e, 1))
            crossed = static_cast<EdgeSet>(crossed | set_of(e));
    }
    std::iota(component_sets_.begin(), component_sets_.end(), std::uint8_t{0});
    std::iota(loop_sets_.begin(), loop_sets_.end(), std::uint8_t{0});
    for (std::size_t f = 0; f < 6; ++f) {
        junctions[f] = find_junctions(corners, f);
        for (const EdgeSet junction : junctions[f]) unite_junction(corners, junction);
    }
    number_components();
    number_loops(corners);
}

// Connects the edges of a junction, and the ends of these edges that have the same label.
void CellBorder::unite_junction(const CellCorners& corners, EdgeSet junction) {
    for_each_edge(junction, [&](std::size_t a) {
        for_each_edge(junction, [&](std::size_t b) {
            unite(component_sets_, a, b);
            for (std::size_t i = 0; i < 2; ++i) {
                for (std::size_t j = 0; j < 2; ++j) {
                    if (label_at(corners, a, i) == label_at(corners, b, j))
                        unite(loop_sets_, 2 * a + i, 2 * b + j);
                }
            }
        });
    });
}

// Numbers the components by their first edges.
void CellBorder::number_components() {
    component_of_edge.fill(kNone);
    for_each_edge(crossed, [&](std::size_t e) {
        const std::size_t first = representative(component_sets_, e);
        if (first == e) {
            component_of_edge[e] = static_cast<std::uint8_t>(edges_of_point.size());
            edges_of_point.push_back(0);
        }
        const std::uint8_t component = component_of_edge[e] = component_of_edge[first];
        edges_of_point[component] = static_cast<EdgeSet>(edges_of_point[component] | set_of(e));
    });
}

// Gives each loop of a label the point of its component, or where another loop of the label has it, a further
// point.
void CellBorder::number_loops(const CellCorners& corners) {
    for (auto& points : point_of_end) points.fill(kNone);
    for_each_edge(crossed, [&](std::size_t e) {
        for (std::size_t end = 0; end < 2; ++end) {
            const std::size_t first = representative(loop_sets_, 2 * e + end);
            std::uint8_t point = component_of_edge[e];
            if (first != 2 * e + end) {
                point = point_of_end[first / 2][first % 2];
            } else if (has_loop_before(corners, e, end)) {
                edges_of_point.push_back(edges_of_point[point]);
                point = static_cast<std::uint8_t>(edges_of_point.size() - 1);
            }
            point_of_end[e][end] = point;
        }
    });
}

// Whether a lower edge in the same component has the label at an end of edge e.
bool CellBorder::has_loop_before(const CellCorners& corners, std::size_t e, std::size_t end) const {
    const std::uint8_t label = label_at(corners, e, end);
    for (std::size_t other = 0; other < e; ++other) {
        if (component_of_edge[other] != component_of_edge[e]) continue;
        if (label_at(corners, other, 0) == label || label_at(corners, other, 1) == label) return true;
    }
    return false;
}

// The mean of the edges' middles.
NetPoint mean_of_edges(EdgeSet edges) {
    NetPoint mean{};
    for_each_edge(edges, [&](std::size_t e) {
        for (std::size_t a = 0; a < 3; ++a)
            mean.xyz[a] +=
                0.5f * static_cast<float>((kEdgeCorners[e][0] >> a & 1) + (kEdgeCorners[e][1] >> a & 1));
    });
    const auto count = static_cast<float>(std::popcount(edges));
    for (std::size_t a = 0; a < 3; ++a) mean.xyz[a] = mean.xyz[a] / count - 0.5f;
    return mean;
}

// As SurfaceCounts::half_triangles.
std::uint64_t count_half_triangles(const CellCorners& corners, EdgeSet crossed, std::uint8_t label) {
    std::uint64_t count = 0;
    for_each_edge(crossed, [&](std::size_t e) {
        if (label_at(corners, e, 0) != label && label_at(corners, e, 1) != label) return;
        const bool along_z = kEdgeCorners[e][1] - kEdgeCorners[e][0] == 4;
        count += along_z ? 1 : slice_of_edge(e) == 0 ? 2 : 0;
    });
    return count;
}

// Fills in the pattern of a cell.
class PatternBuilder {
  public:
    explicit PatternBuilder(const CellCorners& corners) : corners_(corners), border_(corners) {
        pattern_.crossed_edges = border_.crossed;
        add_labels();
        for (const EdgeSet edges : border_.edges_of_point) pattern_.positions.push_back(mean_of_edges(edges));
        add_corners_of_edges();
        for (std::size_t axis = 0; axis < 3; ++axis) add_corners_of_junctions(axis);
        add_faces();
    }
    CellPattern take() { return std::move(pattern_); }

  private:
    void add_labels() {
        for (std::uint8_t v = 0; v < 8; ++v) {
            label_of_corner_[v] = label_of_corner_[corners_.first[v]];
            if (corners_.first[v] != v) continue;
            label_of_corner_[v] = static_cast<std::uint8_t>(pattern_.labels.size());
            pattern_.labels.push_back({v, {0, count_half_triangles(corners_, border_.crossed, v)}});
        }
    }

    // The index of a label's point at a position; adds the point if it is new.
    std::uint8_t label_point(std::uint8_t label, std::uint8_t position) {
        auto& points = pattern_.label_points;
        const auto it = std::find_if(points.begin(), points.end(), [&](const CellPattern::LabelPoint& p) {
            return p.label == label && p.position == position;
        });
        const auto index = static_cast<std::uint8_t>(it - points.begin());
        if (it == points.end()) {
            points.push_back({label, position});
            ++pattern_.labels[label].counts.points;
        }
        return index;
    }

    void add_corner(std::size_t e, std::uint8_t lower_position, std::uint8_t upper_position) {
        const std::uint8_t lower = label_of_corner_[kEdgeCorners[e][0]],
                           upper = label_of_corner_[kEdgeCorners[e][1]];
        const std::uint8_t lower_point = label_point(lower, lower_position),
                           upper_point = label_point(upper, upper_position);
        pattern_.corners.push_back({{lower, upper}, {lower_point, upper_point}, {}});
    }

    void add_corners_of_edges() {
        for_each_edge(border_.crossed, [&](std::size_t e) {
            corner_of_edge_[e] = pattern_.corners.size();
            add_corner(e, border_.point_of_end[e][0], border_.point_of_end[e][1]);
        });
    }

    // Where the lower face along an axis has two junctions, the quads of its edges have a further corner at
    // these. Each face is the lower one of a single cell, which stores the corners for both.
    void add_corners_of_junctions(std::size_t axis) {
        const FaceJunctions& junctions = border_.junctions[2 * axis];
        if (junctions[1] == 0) return;
        const auto first = static_cast<std::uint8_t>(pattern_.positions.size());
        for (const EdgeSet junction : junctions) pattern_.positions.push_back(mean_of_edges(junction));
        for_each_edge(static_cast<EdgeSet>(junctions[0] | junctions[1]), [&](std::size_t e) {
            const auto position = static_cast<std::uint8_t>(first + (contains(junctions[1], e) ? 1 : 0));
            pattern_.corners[corner_of_edge_[e]].junction[axis] =
                static_cast<std::uint8_t>(pattern_.corners.size() - corner_of_edge_[e]);
            add_corner(e, position, position);
            // The further corner adds a triangle to the quads of both labels.
            for (const std::uint8_t label_number : pattern_.corners.back().label) {
                CellPattern::Label& label = pattern_.labels[label_number];
                (slice_of_edge(e) == 0 ? label.counts.half_triangles : label.half_triangles_next) += 2;
            }
        });
    }

    void add_faces() {
        unsigned crossed_faces = 0, faces_of_three = 0;  // bit f: face f has crossed edges, three or more
        bool one_junction_each = true;
        for (std::size_t f = 0; f < 6; ++f) {
            const EdgeSet edges = border_.junctions[f][0];
            pattern_.point_of_face[f] =
                edges == 0 ? kNone : border_.component_of_edge[std::countr_zero(edges)];
            crossed_faces |= unsigned{edges != 0} << f;
            faces_of_three |= unsigned{std::popcount(edges) > 2} << f;
            one_junction_each = one_junction_each && border_.junctions[f][1] == 0;
        }
        // A point that is alone in its cell moves. On a line where three labels or more meet, it moves along
        // the line.
        if (border_.edges_of_point.size() != 1 || !one_junction_each) return;
        const bool on_line = std::popcount(faces_of_three) > 1;
        pattern_.neighbours = static_cast<std::uint8_t>(on_line ? faces_of_three : crossed_faces);
    }

    const CellCorners& corners_;
    const CellBorder border_;
    CellPattern pattern_;
    std::array<std::uint8_t, 8> label_of_corner_{};
    std::array<std::size_t, kCellEdges> corner_of_edge_{};  // in pattern_.corners
};

// A hash of which every bit depends on every bit of the key.
std::uint32_t hash_of(std::uint32_t key) {
    return static_cast<std::uint32_t>(key * 0x9e3779b97f4a7c15u >> 32);
}

struct KeyHash {
    std::size_t operator()(std::uint32_t key) const { return hash_of(key); }
};

}  // namespace

CellPattern make_cell_pattern(const CellCorners& corners) {
    return PatternBuilder(corners).take();
}

const CellPattern& CellPatternCache::find(const CellCorners& corners) {
    // Patterns depend on the corners' key alone, so all maps share them. This map needs no
    // bound: there are 4961 keys (the 4140 ways to divide eight corners among labels, some with several
    // orders of two labels on a face), and a pattern has about a kilobyte.
    static ConcurrentMap<std::uint32_t, CellPattern, KeyHash> patterns;
    const std::uint32_t key = corners.key();
    Entry& entry = entries_[hash_of(key) % entries_.size()];
    if (entry.pattern == nullptr || entry.key != key) {
        auto it = patterns.find(key);
        if (it == patterns.end()) it = patterns.emplace(key, make_cell_pattern(corners)).first;
        entry = {key, &it->second};
    }
    return *entry.pattern;
}

const std::array<TwoLabelCase, 128>& two_label_cases() {
    static const auto table = [] {
        std::array<TwoLabelCase, 128> cases{};
        for (unsigned c = 1; c < cases.size(); ++c) {
            std::array<int, 8> labels;
            for (std::size_t v = 0; v < 8; ++v) labels[v] = static_cast<int>(2 * c >> v & 1);
            const CellPattern pattern = make_cell_pattern(CellCorners(labels));
            cases[c] = {pattern.positions[0], pattern.labels[0].counts, pattern.neighbours};
        }
        return cases;
    }();
    return table;
}

}  // namespace marrow::internal
