// Derives the case table at compile time.
#include "case_table.h"

#include <bit>
#include <cstddef>
#include <utility>

namespace marrow::internal {

namespace {

constexpr bool is_inside(int cell_case, int corner) {
    return (cell_case >> corner & 1) != 0;
}

// Bit f is set if the edge lies in face f. Face 2 * axis + side has the corners whose coordinate on that axis
// is side.
constexpr int faces_of_edge(int edge) {
    const int a = kEdgeCorners[edge][0], b = kEdgeCorners[edge][1];
    int faces = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if ((a >> axis & 1) == (b >> axis & 1)) faces |= 1 << (2 * axis + (a >> axis & 1));
    }
    return faces;
}

// The lines that the surface draws on the faces: next[e] is the edge that follows edge e in its loop, or -1
// if edge e is not crossed.
struct Lines {
    int next[kCellEdges]{};

    constexpr Lines() {
        for (int& edge : next) edge = -1;
    }
};

// Two diagonal corners are inside, and the other two outside.
constexpr bool is_ambiguous(int cell_case, int face) {
    const auto& ring = kFaceCorners[face];
    const bool first = is_inside(cell_case, ring[0]), second = is_inside(cell_case, ring[1]);
    return first != second && is_inside(cell_case, ring[2]) == first &&
           is_inside(cell_case, ring[3]) == second;
}

// The edge from corner i of a face to the next one.
constexpr auto kFaceEdges = [] {
    std::array<std::array<int, 4>, 6> edges{};
    for (std::size_t face = 0; face < 6; ++face) {
        for (std::size_t i = 0; i < 4; ++i)
            edges[face][i] = edge_between(kFaceCorners[face][i], kFaceCorners[face][(i + 1) % 4]);
    }
    return edges;
}();

// Bit f of joined_faces is set if the inside corners of the ambiguous face f are joined.
constexpr Lines draw_lines(int cell_case, int joined_faces) {
    Lines lines;
    for (std::size_t face = 0; face < 6; ++face) {
        const auto& ring = kFaceCorners[face];
        const auto& edges = kFaceEdges[face];
        for (std::size_t start = 0; start < 4; ++start) {
            // A run of inside corners begins on the edge where the walk enters.
            if (is_inside(cell_case, ring[start]) || !is_inside(cell_case, ring[(start + 1) % 4])) continue;
            // A line from there to the edge where the walk leaves cuts the run off. In a joined face the line
            // goes back to the edge where the walk left the run before, and so cuts off the outside corner.
            std::size_t last = start + 1;
            while (is_inside(cell_case, ring[(last + 1) % 4])) ++last;
            if ((joined_faces >> face & 1) != 0) last = start + 3;
            lines.next[edges[start]] = edges[last % 4];
        }
    }
    return lines;
}

constexpr int kForbidden = 1000;

// The cost of a diagonal: the squared distance between the edges' midpoints, so that short ones win.
// Diagonals in a face are forbidden.
constexpr int diagonal_cost(int edge_a, int edge_b) {
    if (faces_of_edge(edge_a) & faces_of_edge(edge_b)) return kForbidden;
    int cost = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int a = (kEdgeCorners[edge_a][0] >> axis & 1) + (kEdgeCorners[edge_a][1] >> axis & 1);
        const int b = (kEdgeCorners[edge_b][0] >> axis & 1) + (kEdgeCorners[edge_b][1] >> axis & 1);
        cost += (a - b) * (a - b);
    }
    return cost;
}

constexpr auto kDiagonalCosts = [] {
    std::array<std::array<int, kCellEdges>, kCellEdges> costs{};
    for (std::size_t a = 0; a < kCellEdges; ++a) {
        for (std::size_t b = 0; b < kCellEdges; ++b)
            costs[a][b] = diagonal_cost(static_cast<int>(a), static_cast<int>(b));
    }
    return costs;
}();

struct Loop {
    std::size_t size = 0;
    std::uint8_t edges[kCellEdges] = {};
};

constexpr void add_triangle(CellShape& shape, std::uint8_t a, std::uint8_t b, std::uint8_t c) {
    const std::size_t slot = 3u * shape.triangles++;
    shape.corners[slot] = a;
    shape.corners[slot + 1] = b;
    shape.corners[slot + 2] = c;
}

// Finds the cheapest triangulation of a loop, by dynamic programming: the triangle on side (i, j) takes the
// third point that is best for all points between i and j. Some loops have none that keeps diagonals out of
// the faces; they become a fan.
constexpr void triangulate(const Loop& loop, CellShape& shape) {
    int cost[kCellEdges][kCellEdges] = {};
    std::size_t third[kCellEdges][kCellEdges] = {};
    for (std::size_t width = 2; width < loop.size; ++width) {
        for (std::size_t i = 0; i + width < loop.size; ++i) {
            const std::size_t j = i + width;
            cost[i][j] = 1 << 20;
            for (std::size_t k = i + 1; k < j; ++k) {
                int sum = cost[i][k] + cost[k][j];
                if (k > i + 1) sum += kDiagonalCosts[loop.edges[i]][loop.edges[k]];
                if (k < j - 1) sum += kDiagonalCosts[loop.edges[k]][loop.edges[j]];
                if (sum < cost[i][j]) {
                    cost[i][j] = sum;
                    third[i][j] = k;
                }
            }
        }
    }
    if (cost[0][loop.size - 1] >= kForbidden) {
        shape.has_fan = true;
        for (std::size_t i = 0; i < loop.size; ++i)
            add_triangle(shape, loop.edges[i], loop.edges[(i + 1) % loop.size], CellShape::kInnerPoint);
        return;
    }
    std::size_t stack[kCellEdges][2] = {{0, loop.size - 1}};
    int depth = 1;
    while (depth > 0) {
        --depth;
        const std::size_t i = stack[depth][0], j = stack[depth][1];
        if (j - i < 2) continue;
        const std::size_t k = third[i][j];
        add_triangle(shape, loop.edges[i], loop.edges[k], loop.edges[j]);
        stack[depth][0] = k, stack[depth][1] = j, ++depth;
        stack[depth][0] = i, stack[depth][1] = k, ++depth;
    }
}

constexpr CellShape derive(int cell_case, int joined_faces) {
    CellShape shape;
    Lines lines = draw_lines(cell_case, joined_faces);
    std::uint8_t points = 0;
    for (int first = 0; first < kCellEdges; ++first) {
        if (lines.next[first] < 0) continue;
        Loop loop;
        for (int e = first; lines.next[e] >= 0;) {
            loop.edges[loop.size++] = shape.loop_edges[points++] = static_cast<std::uint8_t>(e);
            shape.crossed = static_cast<std::uint16_t>(shape.crossed | 1 << e);
            const int next = lines.next[e];
            lines.next[e] = -1;
            e = next;
        }
        shape.loop_ends[shape.loops++] = points;
        triangulate(loop, shape);
    }
    return shape;
}

constexpr std::array<std::uint8_t, 256> find_ambiguous_faces() {
    std::array<std::uint8_t, 256> faces{};
    for (int c = 0; c < 256; ++c) {
        for (int face = 0; face < 6; ++face) {
            if (is_ambiguous(c, face))
                faces[static_cast<std::size_t>(c)] |= static_cast<std::uint8_t>(1 << face);
        }
    }
    return faces;
}

constexpr std::array<std::uint16_t, 256> number_shapes(const std::array<std::uint8_t, 256>& ambiguous) {
    std::array<std::uint16_t, 256> first{};
    for (std::size_t c = 0; c + 1 < 256; ++c)
        first[c + 1] = static_cast<std::uint16_t>(first[c] + (1 << std::popcount(ambiguous[c])));
    return first;
}

constexpr std::array<CellShape, kShapeCount> derive_shapes(const std::array<std::uint8_t, 256>& ambiguous,
                                                           const std::array<std::uint16_t, 256>& first) {
    std::array<CellShape, kShapeCount> shapes{};
    for (std::size_t c = 0; c < 256; ++c) {
        // The subsets of the ambiguous faces in ascending order.
        std::size_t shape = first[c];
        unsigned joined = 0;
        do {
            shapes[shape++] = derive(static_cast<int>(c), static_cast<int>(joined));
            joined = (joined - ambiguous[c]) & ambiguous[c];
        } while (joined != 0);
    }
    return shapes;
}

// The shapes in which no faces are joined.
constexpr std::array<Case, 256> derive_cases(const std::array<CellShape, kShapeCount>& shapes,
                                             const std::array<std::uint16_t, 256>& first) {
    std::array<Case, 256> cases{};
    for (std::size_t c = 0; c < 256; ++c) {
        const CellShape& shape = shapes[first[c]];
        cases[c] = {shape.crossed, shape.loops, shape.triangles, {}};
        for (std::size_t k = 0; k < 3u * shape.triangles; ++k) cases[c].edges[k] = shape.corners[k];
    }
    return cases;
}

constexpr std::array<ShapeChange, kShapeCount> find_changes(const std::array<CellShape, kShapeCount>& shapes,
                                                            const std::array<std::uint16_t, 256>& first) {
    std::array<ShapeChange, kShapeCount> changes{};
    for (std::size_t c = 0; c < 256; ++c) {
        const std::size_t end = c + 1 < 256 ? first[c + 1] : shapes.size();
        for (std::size_t i = first[c]; i < end; ++i) {
            changes[i] = {static_cast<std::int8_t>(shapes[i].triangles - shapes[first[c]].triangles),
                          static_cast<std::uint8_t>(shapes[i].has_fan ? 1 : 0)};
        }
    }
    return changes;
}

constexpr std::array<Case, 256> turn_over(std::array<Case, 256> cases) {
    for (Case& c : cases) {
        for (std::size_t t = 0; t < c.triangles; ++t) std::swap(c.edges[3 * t + 1], c.edges[3 * t + 2]);
    }
    return cases;
}

// Fills `ids` and `advance` of a RunningCase or a RunningShape.
template <class Running>
constexpr void run(unsigned crossed, const std::uint8_t* edges, std::size_t count, Running& running) {
    for (int e = 0; e < 16; ++e) running.advance[e] = crossed >> e % 8 & 1;
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint8_t edge = edges[k];
        const int next = edge < 8 ? 0 : running.advance[edge - 4];
        running.ids[k] = static_cast<std::uint8_t>((edge < 8 ? edge : edge - 4) + 8 * next);
    }
}

// The index into kRunningCases of a case.
constexpr std::size_t by_rows(std::size_t cell_case) {
    std::size_t index = 0;
    for (std::size_t v = 0; v < 8; ++v) index |= (cell_case >> v & 1) << (v / 2 + 4 * (v % 2));
    return index;
}

constexpr std::array<RunningCase, 256> run(const std::array<Case, 256>& cases) {
    std::array<RunningCase, 256> result{};
    for (std::size_t i = 0; i < 256; ++i) {
        const Case& c = cases[i];
        RunningCase& running = result[by_rows(i)];
        running.triangles = c.triangles;
        run(c.crossed, c.edges.data(), 3 * kMaxTriangles, running);
    }
    return result;
}

constexpr RunningShape run(const CellShape& shape, bool mirrored) {
    RunningShape result;
    std::array<std::uint8_t, RunningShape::kIds> corners{};
    const std::size_t second = mirrored ? 2 : 1;
    for (std::size_t t = 0; t < 3u * shape.triangles; t += 3) {
        corners[t] = shape.corners[t];
        corners[t + 1] = shape.corners[t + second];
        corners[t + 2] = shape.corners[t + 3 - second];
    }
    result.triangles = shape.triangles;
    run(shape.crossed, corners.data(), 3u * shape.triangles, result);
    return result;
}

constexpr std::array<RunningShape, kRunningShapeCount> run(const std::array<CellShape, kShapeCount>& shapes,
                                                           const std::array<std::uint16_t, 256>& first,
                                                           bool mirrored) {
    std::array<RunningShape, kRunningShapeCount> result{};
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        if (!shapes[i].has_fan) result[kFirstRunningShape + i] = run(shapes[i], mirrored);
    }
    for (std::size_t c = 0; c < 256; ++c) result[by_rows(c)] = result[kFirstRunningShape + first[c]];
    return result;
}

}  // namespace

constexpr std::array<std::uint8_t, 256> kAmbiguousFaces = find_ambiguous_faces();
constexpr std::array<std::uint16_t, 256> kFirstShape = number_shapes(kAmbiguousFaces);
constexpr std::array<CellShape, kShapeCount> kShapes = derive_shapes(kAmbiguousFaces, kFirstShape);
static_assert(kFirstShape[255] + 1 == kShapeCount);
constexpr std::array<Case, 256> kCases = derive_cases(kShapes, kFirstShape);
constexpr std::array<Case, 256> kMirroredCases = turn_over(kCases);
constexpr std::array<RunningCase, 256> kRunningCases = run(kCases);
constexpr std::array<RunningCase, 256> kMirroredRunningCases = run(kMirroredCases);
constexpr std::array<RunningShape, kRunningShapeCount> kRunningShapes = run(kShapes, kFirstShape, false);
constexpr std::array<RunningShape, kRunningShapeCount> kMirroredRunningShapes =
    run(kShapes, kFirstShape, true);
constexpr std::array<ShapeChange, kShapeCount> kShapeChanges = find_changes(kShapes, kFirstShape);

}  // namespace marrow::internal
