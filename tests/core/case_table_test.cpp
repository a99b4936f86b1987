// The case table follows its rule: outlines lie in the faces, and neighbours agree on shared faces.
#include "core/marching_cubes/case_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <set>
#include <vector>

namespace marrow::internal {
namespace {

constexpr bool inside(unsigned cell_case, int corner) {
    return cell_case >> corner & 1;
}

using Line = std::pair<int, int>;

// The outer edges of a case's triangles: those that no other triangle of the cell runs back along.
std::vector<Line> outline(const Case& c) {
    std::multiset<Line> lines;
    for (int t = 0; t < c.triangles; ++t) {
        for (int k = 0; k < 3; ++k) lines.insert({c.edges[3 * t + k], c.edges[3 * t + (k + 1) % 3]});
    }
    std::vector<Line> outer;
    for (const Line& l : lines) {
        if (!lines.contains({l.second, l.first})) outer.push_back(l);
    }
    return outer;
}

// The faces that an edge lies in: bit 2 * axis + side.
int faces_of(int edge) {
    const int a = kEdgeCorners[edge][0], b = kEdgeCorners[edge][1];
    int faces = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if ((a >> axis & 1) == (b >> axis & 1)) faces |= 1 << (2 * axis + (a >> axis & 1));
    }
    return faces;
}

TEST(CaseTable, CrossesExactlyTheEdgesWithOneEndInside) {
    for (unsigned i = 0; i < 256; ++i) {
        std::set<int> used;
        for (int k = 0; k < 3 * kCases[i].triangles; ++k) used.insert(kCases[i].edges[k]);
        for (int e = 0; e < kCellEdges; ++e) {
            const bool crossed = inside(i, kEdgeCorners[e][0]) != inside(i, kEdgeCorners[e][1]);
            EXPECT_EQ(crossed, (kCases[i].crossed >> e & 1) != 0) << "case " << i << " edge " << e;
            EXPECT_EQ(crossed, used.contains(e)) << "case " << i << " edge " << e;
        }
    }
}

TEST(CaseTable, LoopsOfKPointsMakeKMinusTwoTriangles) {
    for (const Case& c : kCases) EXPECT_EQ(c.triangles, std::popcount(c.crossed) - 2 * c.loops);
}

TEST(CaseTable, OutlineLiesInTheFacesAndDiagonalsDoNot) {
    for (unsigned i = 0; i < 256; ++i) {
        const auto outer = outline(kCases[i]);
        EXPECT_EQ(outer.size(), static_cast<std::size_t>(std::popcount(kCases[i].crossed)));
        for (const auto& [a, b] : outer) EXPECT_NE(faces_of(a) & faces_of(b), 0) << "case " << i;
        for (int t = 0; t < kCases[i].triangles; ++t) {
            for (int k = 0; k < 3; ++k) {
                const Line side{kCases[i].edges[3 * t + k], kCases[i].edges[3 * t + (k + 1) % 3]};
                if (std::find(outer.begin(), outer.end(), side) != outer.end()) continue;
                EXPECT_EQ(faces_of(side.first) & faces_of(side.second), 0)
                    << "case " << i << ": a diagonal in a face";
            }
        }
    }
}

// For all 256 cases and every neighbour across every axis, the lines on the shared face are the same, with
// opposite direction.
TEST(CaseTable, NeighboursAgreeOnTheirSharedFace) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto lines_on = [&](unsigned cell_case, int side) {
            std::set<Line> lines;
            const int face = 1 << (2 * axis + side);
            for (auto [a, b] : outline(kCases[cell_case])) {
                if (!(faces_of(a) & faces_of(b) & face)) continue;
                const auto name = [&](int e) {  // the edge by its corners, without the axis
                    const int mask = 7 & ~(1 << axis);
                    return (kEdgeCorners[e][0] & mask) * 8 + (kEdgeCorners[e][1] & mask);
                };
                lines.insert(side == 1 ? Line{name(a), name(b)} : Line{name(b), name(a)});
            }
            return lines;
        };
        for (unsigned left = 0; left < 256; ++left) {
            for (unsigned right = 0; right < 256; ++right) {
                bool neighbours = true;
                for (int v = 0; v < 8; ++v) {
                    if (!(v >> axis & 1)) neighbours &= inside(right, v) == inside(left, v | 1 << axis);
                }
                if (neighbours) {
                    ASSERT_EQ(lines_on(left, 1), lines_on(right, 0)) << left << " " << right;
                }
            }
        }
    }
}

TEST(CaseTable, OneInsideCornerIsCutOffFacingAway) {
    // With corner 0 inside, the triangle through (1,0,0), (0,1,0), (0,0,1) is counter-clockwise seen from
    // (1,1,1).
    const Case& c = kCases[1];
    ASSERT_EQ(c.triangles, 1);
    std::vector<int> edges(c.edges.begin(), c.edges.begin() + 3);
    std::rotate(edges.begin(), std::find(edges.begin(), edges.end(), 0), edges.end());
    EXPECT_EQ(edges, (std::vector<int>{0, 4, 6}));
}

}  // namespace
}  // namespace marrow::internal
