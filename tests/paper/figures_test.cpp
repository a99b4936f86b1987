// The figures of Visutsak 2020, "Marching Cubes and Histogram Pyramids for 3D Medical Visualization", as
// tests.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <marrow/histo_pyramid.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "core/marching_cubes/case_table.h"
#include "support/fields.h"

namespace marrow {
namespace {

using internal::Case;
using internal::kCases;
using internal::kCellEdges;
using internal::kEdgeCorners;

// ---- Figure 5: the index 01000001 and the edges it cuts ----

// The paper's corners v1 to v8 run round the lower face, then round the upper one; here as our corner
// numbers.
constexpr int kPaperCorners[8] = {0, 1, 3, 2, 4, 5, 7, 6};
// Its edges e1 to e12 by their corners: lower ring, upper ring, uprights. Its e11 stands on v4 and its e12 on
// v3.
constexpr int kPaperEdges[12][2] = {{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 6}, {6, 7},
                                    {7, 8}, {8, 5}, {1, 5}, {2, 6}, {4, 8}, {3, 7}};

// Bit 0 of the paper's index is v1.
unsigned case_of_paper_index(unsigned index) {
    unsigned cell_case = 0;
    for (unsigned v = 0; v < 8; ++v) cell_case |= (index >> v & 1) << kPaperCorners[v];
    return cell_case;
}

int paper_edge(int edge) {
    for (int e = 0; e < 12; ++e) {
        const int a = kPaperCorners[kPaperEdges[e][0] - 1], b = kPaperCorners[kPaperEdges[e][1] - 1];
        if (std::min(a, b) == kEdgeCorners[edge][0] && std::max(a, b) == kEdgeCorners[edge][1]) return e + 1;
    }
    return 0;
}

// A triangle by the paper's edge numbers, in its order but starting at the smallest.
std::array<int, 3> paper_triangle(const Case& c, int triangle) {
    std::array<int, 3> edges{};
    for (int k = 0; k < 3; ++k)
        edges[static_cast<std::size_t>(k)] = paper_edge(c.edges[static_cast<std::size_t>(3 * triangle + k)]);
    std::rotate(edges.begin(), std::min_element(edges.begin(), edges.end()), edges.end());
    return edges;
}

TEST(PaperFigure5, EveryEdgeOfThePaperIsAnEdgeOfACell) {
    std::set<int> found;
    for (int e = 0; e < kCellEdges; ++e) found.insert(paper_edge(e));
    EXPECT_EQ(found.size(), 12u);
    EXPECT_FALSE(found.contains(0));
}

TEST(PaperFigure5, Index01000001CutsOffV1AndV7) {
    const unsigned index = 0b01000001;
    EXPECT_EQ(index, 65u);
    const Case& c = kCases[case_of_paper_index(index)];
    ASSERT_EQ(c.triangles, 2);
    const std::set<std::array<int, 3>> triangles{paper_triangle(c, 0), paper_triangle(c, 1)};
    // Counter-clockwise seen from the side away from the marked corner; e1, e4 and e9 leave v1 along x, y, z.
    // (The paper marks outer vertices and Marrow inside ones, which is the complement, below.)
    EXPECT_EQ(triangles, (std::set<std::array<int, 3>>{{1, 4, 9}, {6, 7, 12}}));
}

TEST(PaperFigure5, TheComplementHasTheSameEdgesAndTheOppositeWinding) {
    const Case& c = kCases[case_of_paper_index(65)];
    const Case& complement = kCases[case_of_paper_index(190)];
    EXPECT_EQ(case_of_paper_index(65) ^ case_of_paper_index(190), 255u);
    EXPECT_EQ(complement.crossed, c.crossed);
    const std::set<std::array<int, 3>> triangles{paper_triangle(complement, 0),
                                                 paper_triangle(complement, 1)};
    EXPECT_EQ(triangles, (std::set<std::array<int, 3>>{{1, 9, 4}, {6, 12, 7}}));
}

// A cell with `diagonal` at v1 and v7 and `rest` elsewhere, sampled n + 1 times a side through its trilinear
// interpolant.
Volume body_diagonal_cell(double diagonal, double rest, std::int64_t n) {
    return test::sampled<float>(test::grid(n + 1, n + 1, n + 1), [&](auto i, auto j, auto k) {
        const double x = static_cast<double>(i) / static_cast<double>(n);
        const double y = static_cast<double>(j) / static_cast<double>(n);
        const double z = static_cast<double>(k) / static_cast<double>(n);
        return rest + (diagonal - rest) * (x * y * z + (1 - x) * (1 - y) * (1 - z));
    });
}

TEST(PaperFigure5, TwoTrianglesAreTheTopologyOfTheFigureButNotOfATunnel) {
    const auto surface = [](double diagonal, double rest, std::int64_t n) {
        const Volume cell = body_diagonal_cell(diagonal, rest, n);
        return measure(extract_isosurface(cell, 0));
    };
    // -0.5 against 0.5: two sheets, in the cell and in the interpolant that it stands for.
    EXPECT_EQ(surface(-0.5, 0.5, 1).components, 2);
    EXPECT_EQ(surface(-0.5, 0.5, 40).components, 2);
    EXPECT_EQ(surface(-0.5, 0.5, 40).euler_characteristic, 2) << "two discs";
    // -3 against 0.4: the interpolant joins the corners by a tunnel (case 4.2 of Chernyaev 1995), and a table
    // that looks at signs alone cannot know it: a limit of the method, in the paper as here.
    EXPECT_EQ(surface(-3, 0.4, 40).components, 1);
    EXPECT_EQ(surface(-3, 0.4, 40).euler_characteristic, 0) << "a tube";
    EXPECT_EQ(surface(-3, 0.4, 1).components, 2);
    EXPECT_EQ(surface(-3, 0.4, 1).triangles, 2);
}

// ---- Figure 9: the slots of a brick ----

// Corner xyz of a brick -> its slot. Not Morton order: V001 comes before V110.
int paper_slot(std::int64_t x, std::int64_t y, std::int64_t z) {
    static const std::map<std::string, int> slots{{"000", 0}, {"100", 1}, {"010", 2}, {"001", 3},
                                                  {"101", 4}, {"011", 5}, {"110", 6}, {"111", 7}};
    return slots.at(std::to_string(x) + std::to_string(y) + std::to_string(z));
}

// Where the element at (x, y, z) stands in an octree whose children are ordered as in Figure 9.
std::size_t paper_leaf(std::int64_t x, std::int64_t y, std::int64_t z, int levels) {
    std::size_t leaf = 0;
    for (int level = levels - 1; level >= 0; --level)
        leaf =
            8 * leaf + static_cast<std::size_t>(paper_slot(x >> level & 1, y >> level & 1, z >> level & 1));
    return leaf;
}

TEST(PaperFigure9, ABrickHasItsChildrenInSlots0To7AndTheirSumInSlot8) {
    const std::vector<std::uint32_t> counts{3, 0, 5, 1,
                                            9, 0, 0, 2};  // V000 V100 V010 V001 V101 V011 V110 V111
    const HistoPyramid brick(counts, 8);
    ASSERT_EQ(brick.levels().size(), 1u);
    ASSERT_EQ(brick.levels().back().size(), 1u);
    EXPECT_EQ(brick.levels().back().front(), 20u) << "slot 8, where the traversal starts";
    EXPECT_EQ(brick.total(), 20u);
    // "If V101 (index no. 4)": its outputs are 9 to 17.
    EXPECT_EQ(paper_slot(1, 0, 1), 4);
    EXPECT_EQ(brick.locate(8).leaf, 3u);
    for (std::uint64_t key = 9; key < 18; ++key) EXPECT_EQ(brick.locate(key).leaf, 4u);
    EXPECT_EQ(brick.locate(18).leaf, 7u);
}

TEST(PaperFigure9, TheOrderIsThatOfTheTrilinearFormula) {
    // V000 (1-x)(1-y)(1-z) + V100 x(1-y)(1-z) + V010 (1-x)y(1-z) + V001 (1-x)(1-y)z + V101 x(1-y)z + V011
    // (1-x)yz
    // + V110 xy(1-z) + V111 xyz (Bourke): the weight of slot s is 1 at its own corner and 0 at all others.
    const auto weights = [](double x, double y, double z) {
        return std::array<double, 8>{(1 - x) * (1 - y) * (1 - z),
                                     x * (1 - y) * (1 - z),
                                     (1 - x) * y * (1 - z),
                                     (1 - x) * (1 - y) * z,
                                     x * (1 - y) * z,
                                     (1 - x) * y * z,
                                     x * y * (1 - z),
                                     x * y * z};
    };
    for (int v = 0; v < 8; ++v) {
        const int x = v & 1, y = v >> 1 & 1, z = v >> 2;
        const auto w = weights(x, y, z);
        for (int s = 0; s < 8; ++s)
            EXPECT_EQ(w[static_cast<std::size_t>(s)], s == paper_slot(x, y, z) ? 1 : 0);
    }
}

TEST(PaperFigure9, Slot8IsTheSumOfSlots0To7AtEveryLevel) {
    constexpr int kLevels = 3;
    constexpr std::int64_t kSide = 1 << kLevels;
    test::Random random(9);
    std::vector<std::uint32_t> image(kSide * kSide * kSide), leaves(image.size());
    const auto at = [](auto x, auto y, auto z) {
        return static_cast<std::size_t>((z * kSide + y) * kSide + x);
    };
    for (std::int64_t z = 0; z < kSide; ++z) {
        for (std::int64_t y = 0; y < kSide; ++y) {
            for (std::int64_t x = 0; x < kSide; ++x) {
                image[at(x, y, z)] = static_cast<std::uint32_t>(random() % 6);
                leaves[paper_leaf(x, y, z, kLevels)] = image[at(x, y, z)];
            }
        }
    }
    const HistoPyramid octree(leaves, 8);
    ASSERT_EQ(octree.levels().size(), static_cast<std::size_t>(kLevels));
    for (int level = 1; level <= kLevels; ++level) {
        const std::int64_t bricks = kSide >> level, width = 1 << level;
        for (std::int64_t z = 0; z < bricks; ++z) {
            for (std::int64_t y = 0; y < bricks; ++y) {
                for (std::int64_t x = 0; x < bricks; ++x) {
                    std::uint64_t sum = 0;  // straight from the image
                    for (std::int64_t i = 0; i < width * width * width; ++i)
                        sum += image[at(x * width + i % width, y * width + i / width % width,
                                        z * width + i / width / width)];
                    EXPECT_EQ(octree.levels()[static_cast<std::size_t>(level - 1)]
                                             [paper_leaf(x, y, z, kLevels - level)],
                              sum);
                }
            }
        }
    }
}

// ---- Figure 10: a traversal ----

struct Pixel {
    std::int64_t x, y;  // column, row from the top
    friend bool operator==(const Pixel&, const Pixel&) = default;
};

std::size_t morton(std::int64_t x, std::int64_t y) {
    std::size_t code = 0;
    for (int bit = 0; bit < 16; ++bit)
        code |= static_cast<std::size_t>((x >> bit & 1) << 2 * bit | (y >> bit & 1) << (2 * bit + 1));
    return code;
}

std::size_t morton(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::size_t code = 0;
    for (int bit = 0; bit < 16; ++bit)
        code |= static_cast<std::size_t>((x >> bit & 1) << 3 * bit | (y >> bit & 1) << (3 * bit + 1) |
                                         (z >> bit & 1) << (3 * bit + 2));
    return code;
}

Pixel pixel_of(std::size_t code) {
    Pixel p{0, 0};
    for (int bit = 0; bit < 16; ++bit) {
        p.x |= static_cast<std::int64_t>(code >> 2 * bit & 1) << bit;
        p.y |= static_cast<std::int64_t>(code >> (2 * bit + 1) & 1) << bit;
    }
    return p;
}

// A base that satisfies the figure. What the figure shows, its upper right block and the levels above it, is
// forced.
constexpr std::uint32_t kFigure10[4][4] = {{1, 1, 0, 1}, {0, 1, 1, 0}, {1, 0, 0, 1}, {1, 1, 0, 0}};

HistoPyramid figure_10() {
    std::vector<std::uint32_t> leaves(16);
    for (std::int64_t y = 0; y < 4; ++y) {
        for (std::int64_t x = 0; x < 4; ++x) leaves[morton(x, y)] = kFigure10[y][x];
    }
    return HistoPyramid(leaves, 4);
}

TEST(PaperFigure10, LevelsAreThoseOfTheFigure) {
    const HistoPyramid p = figure_10();
    ASSERT_EQ(p.levels().size(), 2u);
    EXPECT_EQ(p.levels()[0], (std::vector<std::uint64_t>{3, 2, 3, 1})) << "L1: UL, UR, LL, LR";
    EXPECT_EQ(p.levels()[1], (std::vector<std::uint64_t>{9})) << "L2";
}

TEST(PaperFigure10, Keys0To8FindTheirEntries) {
    const HistoPyramid p = figure_10();
    const std::vector<Pixel> expected{{0, 0}, {1, 0}, {1, 1}, {3, 0}, {2, 1}, {0, 2}, {0, 3}, {1, 3}, {3, 2}};
    ASSERT_EQ(p.total(), expected.size());
    for (std::size_t key = 0; key < expected.size(); ++key) {
        const auto found = p.locate(key);
        EXPECT_EQ(pixel_of(found.leaf), expected[key]) << "key " << key;
        EXPECT_EQ(found.remainder, 0u);
    }
    EXPECT_EQ(pixel_of(p.locate(4).leaf), (Pixel{2, 1})) << "the point of the figure";
}

// The rule as printed: take the first non-empty child whose range [start, end) has start + end >= bound. It
// needs no key: whatever is looked for, the same entry is found.
std::optional<Pixel> printed_rule(const HistoPyramid& p, std::uint64_t bound) {
    std::size_t node = 0;
    std::uint64_t start = 0;
    for (std::size_t level = p.levels().size(); level-- > 0;) {
        const auto count = [&](std::size_t child) {
            return level > 0 ? p.levels()[level - 1][child] : std::uint64_t{p.leaves()[child]};
        };
        std::optional<std::size_t> fit;
        for (std::size_t child = 4 * node; child < 4 * node + 4 && !fit; ++child) {
            const std::uint64_t end = start + count(child);
            if (end > start && start + end >= bound)
                fit = child;
            else
                start = end;
        }
        if (!fit) return std::nullopt;
        node = *fit;
    }
    return pixel_of(node);
}

TEST(PaperFigure10, ThePrintedRuleFindsOneEntryForEveryKey) {
    const HistoPyramid p = figure_10();
    EXPECT_EQ(printed_rule(p, 8), (Pixel{2, 1})) << "right for key 4 alone";
    for (std::uint64_t key = 0; key < 9; ++key) {
        const bool right = printed_rule(p, 8) == pixel_of(p.locate(key).leaf);
        EXPECT_EQ(right, key == 4) << "key " << key;
    }
}

TEST(PaperFigure10, ThePrintedRuleForAnyKeyStillMissesTwo) {
    const HistoPyramid p = figure_10();
    std::set<std::uint64_t> missed;
    for (std::uint64_t key = 0; key < 9; ++key) {
        if (printed_rule(p, 2 * key) != pixel_of(p.locate(key).leaf)) missed.insert(key);
    }
    EXPECT_EQ(missed, (std::set<std::uint64_t>{2, 7}));
}

// ---- Quadtree and octree over Morton-ordered leaves ----

TEST(MortonPyramid, AQuadtreeElementIsTheSumOfItsSquare) {
    constexpr std::int64_t kColumns = 19, kRows = 27, kSide = 32;  // not powers of two: the rest is empty
    test::Random random(10);
    std::vector<std::uint32_t> leaves(kSide * kSide, 0);
    for (std::int64_t y = 0; y < kRows; ++y) {
        for (std::int64_t x = 0; x < kColumns; ++x)
            leaves[morton(x, y)] = static_cast<std::uint32_t>(random() % 3);
    }
    const HistoPyramid quadtree(leaves, 4);
    ASSERT_EQ(quadtree.levels().size(), 5u);
    for (int level = 1; level <= 5; ++level) {
        const std::int64_t width = 1 << level;
        for (std::int64_t y = 0; y < kSide / width; ++y) {
            for (std::int64_t x = 0; x < kSide / width; ++x) {
                std::uint64_t sum = 0;
                for (std::int64_t i = 0; i < width * width; ++i)
                    sum += leaves[morton(x * width + i % width, y * width + i / width)];
                EXPECT_EQ(quadtree.levels()[static_cast<std::size_t>(level - 1)][morton(x, y)], sum);
            }
        }
    }
    std::map<std::size_t, std::uint64_t> outputs;
    for (std::uint64_t key = 0; key < quadtree.total(); ++key) {
        const auto found = quadtree.locate(key);
        EXPECT_EQ(found.remainder, outputs[found.leaf]++);
    }
    for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) EXPECT_EQ(outputs[leaf], leaves[leaf]);
}

// The paper's own use: the histogram of a volume's cells as an octree, traversed for the point list. It must
// name the same triangles, cell by cell, as extraction does.
TEST(MortonPyramid, AnOctreeOverCellsListsTheTrianglesOfTheSurface) {
    constexpr std::int64_t kSamples = 13;
    const Volume ball = test::sampled_in_space<float>(test::grid(kSamples, kSamples, kSamples),
                                                      test::sphere({6.1, 5.9, 6.2}, 4.7));
    const float* samples = ball.samples<float>();
    std::vector<std::uint32_t> leaves(16 * 16 * 16, 0);
    for (std::int64_t z = 0; z + 1 < kSamples; ++z) {
        for (std::int64_t y = 0; y + 1 < kSamples; ++y) {
            for (std::int64_t x = 0; x + 1 < kSamples; ++x) {
                unsigned cell_case = 0;
                for (int v = 0; v < 8; ++v) {
                    const std::int64_t i =
                        ((z + (v >> 2)) * kSamples + y + (v >> 1 & 1)) * kSamples + x + (v & 1);
                    cell_case |= unsigned{samples[i] >= 0} << v;
                }
                leaves[morton(x, y, z)] = kCases[cell_case].triangles;
            }
        }
    }
    const HistoPyramid octree(leaves, 8);
    const Mesh mesh = extract_isosurface(ball, 0);
    ASSERT_EQ(octree.total(), mesh.triangles.size());

    std::map<std::size_t, std::uint32_t> from_mesh, from_octree;
    for (const Triangle& t : mesh.triangles) {
        std::int64_t cell[3];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float sum = mesh.points[t[0]][axis] + mesh.points[t[1]][axis] + mesh.points[t[2]][axis];
            cell[axis] = static_cast<std::int64_t>(std::floor(sum / 3));
        }
        ++from_mesh[morton(cell[0], cell[1], cell[2])];
    }
    for (std::uint64_t key = 0; key < octree.total(); ++key) {
        const auto found = octree.locate(key);
        EXPECT_EQ(found.remainder, from_octree[found.leaf]++) << "the local triangle";
    }
    EXPECT_EQ(from_octree, from_mesh);
}

}  // namespace
}  // namespace marrow
