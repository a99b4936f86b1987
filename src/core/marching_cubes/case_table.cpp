// Derives the case table at compile time.
#include "case_table.h"

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

constexpr Lines draw_lines(int cell_case) {
    Lines lines;
    for (const auto& ring : kFaceCorners) {
        for (int start = 0; start < 4; ++start) {
            // A run of inside corners begins on the edge where the walk enters. A line from there to the edge
            // where the walk leaves cuts it off.
            if (is_inside(cell_case, ring[start]) || !is_inside(cell_case, ring[(start + 1) % 4])) continue;
            int last = start + 1;
            while (is_inside(cell_case, ring[(last + 1) % 4])) ++last;
            const int enter = edge_between(ring[start], ring[(start + 1) % 4]);
            const int leave = edge_between(ring[last % 4], ring[(last + 1) % 4]);
            lines.next[enter] = leave;
        }
    }
    return lines;
}

// The cost of a diagonal: the squared distance between the edges' midpoints, so that short ones win.
// Diagonals in a face are forbidden.
constexpr int diagonal_cost(int edge_a, int edge_b) {
    if (faces_of_edge(edge_a) & faces_of_edge(edge_b)) return 1000;
    int cost = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int a = (kEdgeCorners[edge_a][0] >> axis & 1) + (kEdgeCorners[edge_a][1] >> axis & 1);
        const int b = (kEdgeCorners[edge_b][0] >> axis & 1) + (kEdgeCorners[edge_b][1] >> axis & 1);
        cost += (a - b) * (a - b);
    }
    return cost;
}

struct Loop {
    int size = 0;
    int edges[kCellEdges] = {};
};

// Finds the cheapest triangulation of a loop, by dynamic programming: the triangle on side (i, j) takes the
// third point that is best for all points between i and j.
constexpr void triangulate(const Loop& loop, Case& result) {
    int cost[kCellEdges][kCellEdges] = {};
    int third[kCellEdges][kCellEdges] = {};
    for (int width = 2; width < loop.size; ++width) {
        for (int i = 0; i + width < loop.size; ++i) {
            const int j = i + width;
            cost[i][j] = 1 << 20;
            for (int k = i + 1; k < j; ++k) {
                int sum = cost[i][k] + cost[k][j];
                if (k > i + 1) sum += diagonal_cost(loop.edges[i], loop.edges[k]);
                if (k < j - 1) sum += diagonal_cost(loop.edges[k], loop.edges[j]);
                if (sum < cost[i][j]) {
                    cost[i][j] = sum;
                    third[i][j] = k;
                }
            }
        }
    }
    int stack[kCellEdges][2] = {{0, loop.size - 1}};
    int depth = 1;
    while (depth > 0) {
        --depth;
        const int i = stack[depth][0], j = stack[depth][1];
        if (j - i < 2) continue;
        const int k = third[i][j];
        int slot = 3 * result.triangles++;
        for (int corner : {i, k, j}) result.edges[slot++] = static_cast<std::uint8_t>(loop.edges[corner]);
        stack[depth][0] = k, stack[depth][1] = j, ++depth;
        stack[depth][0] = i, stack[depth][1] = k, ++depth;
    }
}

constexpr Case derive(int cell_case) {
    Case result;
    Lines lines = draw_lines(cell_case);
    for (int first = 0; first < kCellEdges; ++first) {
        if (lines.next[first] < 0) continue;
        Loop loop;
        for (int e = first; lines.next[e] >= 0;) {
            loop.edges[loop.size++] = e;
            result.crossed = static_cast<std::uint16_t>(result.crossed | 1 << e);
            const int next = lines.next[e];
            lines.next[e] = -1;
            e = next;
        }
        ++result.loops;
        triangulate(loop, result);
    }
    return result;
}

constexpr std::array<Case, 256> derive_all() {
    std::array<Case, 256> cases{};
    for (int c = 0; c < 256; ++c) cases[static_cast<std::size_t>(c)] = derive(c);
    return cases;
}

constexpr std::array<Case, 256> turn_over(std::array<Case, 256> cases) {
    for (Case& c : cases) {
        for (std::size_t t = 0; t < c.triangles; ++t) std::swap(c.edges[3 * t + 1], c.edges[3 * t + 2]);
    }
    return cases;
}

constexpr std::array<RunningCase, 256> run(const std::array<Case, 256>& cases) {
    std::array<RunningCase, 256> result{};
    for (std::size_t i = 0; i < 256; ++i) {
        const Case& c = cases[i];
        std::size_t by_rows = 0;
        for (std::size_t v = 0; v < 8; ++v) by_rows |= (i >> v & 1) << (v / 2 + 4 * (v % 2));
        RunningCase& running = result[by_rows];
        running.triangles = c.triangles;
        for (int e = 0; e < 8; ++e) running.advance[e] = c.crossed >> e & 1;
        for (std::size_t k = 0; k < 16; ++k) {
            const std::uint8_t edge = c.edges[k];
            const int next = edge < 8 ? 0 : running.advance[edge - 4];
            running.ids[k] = static_cast<std::uint8_t>((edge < 8 ? edge : edge - 4) + 8 * next);
        }
    }
    return result;
}

}  // namespace

constexpr std::array<Case, 256> kCases = derive_all();
constexpr std::array<Case, 256> kMirroredCases = turn_over(kCases);
constexpr std::array<RunningCase, 256> kRunningCases = run(kCases);
constexpr std::array<RunningCase, 256> kMirroredRunningCases = run(kMirroredCases);

}  // namespace marrow::internal
