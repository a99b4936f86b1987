// The case table follows its rule: outlines lie in the faces, and neighbours agree on shared faces.
#include "core/marching_cubes/case_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <map>
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

// The ambiguous faces of a case that a shape joins, by its place among the shapes of the case.
unsigned joined_faces(unsigned cell_case, unsigned place) {
    unsigned joined = 0;
    for (unsigned left = kAmbiguousFaces[cell_case]; left != 0; left &= left - 1, place >>= 1) {
        if ((place & 1) != 0) joined |= left & (~left + 1);
    }
    return joined;
}

unsigned shapes_of(unsigned cell_case) {
    return 1u << std::popcount(kAmbiguousFaces[cell_case]);
}

// The lines of a shape's loops, on the faces.
std::vector<Line> lines_of(const CellShape& shape) {
    std::vector<Line> lines;
    int first = 0;
    for (int loop = 0; loop < shape.loops; ++loop) {
        const int end = shape.loop_ends[static_cast<std::size_t>(loop)];
        for (int i = first; i < end; ++i) {
            const auto next = static_cast<std::size_t>(i + 1 < end ? i + 1 : first);
            lines.push_back({shape.loop_edges[static_cast<std::size_t>(i)], shape.loop_edges[next]});
        }
        first = end;
    }
    return lines;
}

TEST(CellShapes, BeginWithTheCaseThatJoinsNothing) {
    for (unsigned c = 0; c < 256; ++c) {
        const CellShape& shape = kShapes[kFirstShape[c]];
        EXPECT_EQ(shape.loops, kCases[c].loops);
        EXPECT_EQ(shape.triangles, kCases[c].triangles);
        EXPECT_FALSE(shape.has_fan);
        EXPECT_TRUE(std::equal(kCases[c].edges.begin(), kCases[c].edges.begin() + 3 * shape.triangles,
                               shape.corners.begin()));
    }
}

// Every line of the faces is the outer side of one triangle, and no other side lies in a face: so cells that
// agree on the lines of their shared face fit together to a manifold, whatever is decided for other faces.
TEST(CellShapes, TrianglesHaveTheLinesAsOutlineAndNoOtherSideInAFace) {
    int fans = 0;
    for (const CellShape& shape : kShapes) {
        std::multiset<Line> sides;
        for (std::size_t t = 0; t < shape.triangles; ++t) {
            for (std::size_t k = 0; k < 3; ++k)
                sides.insert({shape.corners[3 * t + k], shape.corners[3 * t + (k + 1) % 3]});
        }
        std::set<Line> outer;
        for (const Line& side : sides) {
            EXPECT_EQ(sides.count(side), 1u);
            if (sides.contains({side.second, side.first})) {
                if (side.first < kCellEdges && side.second < kCellEdges) {
                    EXPECT_EQ(faces_of(side.first) & faces_of(side.second), 0);
                }
            } else {
                outer.insert(side);
            }
        }
        const std::vector<Line> lines = lines_of(shape);
        EXPECT_EQ(outer, std::set<Line>(lines.begin(), lines.end()));
        EXPECT_EQ(shape.triangles, std::popcount(shape.crossed) - 2 * shape.loops + (shape.has_fan ? 2 : 0));
        fans += shape.has_fan ? 1 : 0;
    }
    EXPECT_EQ(fans, 116);
}

// The lines on a face depend on its four corners and on whether the face is joined, and on nothing else. Seen
// from the other side they are the same, in the opposite direction.
TEST(CellShapes, LinesDependOnTheFaceAlone) {
    for (int axis = 0; axis < 3; ++axis) {
        std::map<std::pair<unsigned, bool>, std::set<Line>> lines_of_face;
        for (unsigned c = 0; c < 256; ++c) {
            for (unsigned place = 0; place < shapes_of(c); ++place) {
                for (const int side : {0, 1}) {
                    const int face = 2 * axis + side;
                    const auto across = [&](int corner) { return corner & ~(1 << axis); };
                    unsigned corners = 0;
                    for (int v = 0; v < 8; ++v) {
                        if ((v >> axis & 1) == side && inside(c, v)) corners |= 1u << across(v);
                    }
                    std::set<Line> lines;
                    for (const auto& [a, b] : lines_of(kShapes[kFirstShape[c] + place])) {
                        if ((faces_of(a) & faces_of(b) & 1 << face) == 0) continue;
                        const auto name = [&](int e) {
                            return across(kEdgeCorners[e][0]) * 8 + across(kEdgeCorners[e][1]);
                        };
                        lines.insert(side == 1 ? Line{name(a), name(b)} : Line{name(b), name(a)});
                    }
                    const bool joined = (joined_faces(c, place) >> face & 1) != 0;
                    const auto [at, is_new] = lines_of_face.insert({{corners, joined}, lines});
                    EXPECT_TRUE(is_new || at->second == lines) << c << ' ' << place << ' ' << face;
                }
            }
        }
    }
}

}  // namespace
}  // namespace marrow::internal
