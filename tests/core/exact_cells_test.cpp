// Surfaces with exact topology against straightforward marching cubes, cell by cell: the reference draws
// the lines of each face by its definition, follows them to loops, and says which loops a tunnel joins. It
// shares no table, decision or arithmetic with the library. Points and plain surfaces are compared with
// the classic algorithm elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include <marrow/isosurface.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using Index = std::array<std::int64_t, 3>;
using Corners = std::array<double, 8>;  // sample - isovalue; NaN: there is no finite sample
using Line =
    std::pair<int, int>;  // from edge to edge, with the inside on its right, seen from outside the cell

// An edge, by its middle: twice its coordinates in the cell, in base 3.
int edge_between(unsigned a, unsigned b) {
    int edge = 0;
    for (int axis = 2; axis >= 0; --axis)
        edge = 3 * edge + static_cast<int>((a >> axis & 1) + (b >> axis & 1));
    return edge;
}

// Exact: the products of two doubles have 106 bits.
using Wide = __float128;

bool joins(double inside_a, double inside_b, double outside_a, double outside_b) {
    if (!std::isfinite(outside_a) || !std::isfinite(outside_b)) return false;
    return static_cast<Wide>(inside_a) * inside_b >= static_cast<Wide>(outside_a) * outside_b;
}

// The lines that the surface draws on the faces of a cell.
std::set<Line> lines_of(const Corners& f) {
    std::set<Line> lines;
    for (unsigned axis = 0; axis < 3; ++axis) {
        for (unsigned side = 0; side < 2; ++side) {
            const unsigned u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3, base = side << axis;
            std::array<unsigned, 4> ring{base, base | u, base | u | v, base | v};
            if (side == 0) std::reverse(ring.begin(), ring.end());  // counter-clockwise, seen from outside
            const auto at = [&](std::size_t i) { return f[ring[i % 4]]; };
            for (std::size_t i = 0; i < 4; ++i) {
                if (at(i) >= 0 || !(at(i + 1) >= 0)) continue;  // the walk does not enter the inside here
                const bool ambiguous = !(at(i + 2) >= 0) && at(i + 3) >= 0;
                std::size_t leaves = i + 1;
                while (at(leaves + 1) >= 0) ++leaves;
                if (ambiguous && joins(at(i + 1), at(i + 3), at(i), at(i + 2))) leaves = i + 3;
                lines.insert({edge_between(ring[i], ring[(i + 1) % 4]),
                              edge_between(ring[leaves % 4], ring[(leaves + 1) % 4])});
            }
        }
    }
    return lines;
}

std::vector<std::vector<int>> loops_of(const std::set<Line>& lines) {
    std::map<int, int> next(lines.begin(), lines.end());
    std::vector<std::vector<int>> loops;
    while (!next.empty()) {
        loops.emplace_back();
        for (auto at = next.begin(); at != next.end(); at = next.find(loops.back().back())) {
            loops.back().push_back(at->second);
            next.erase(at);
        }
    }
    return loops;
}

int sign(__int128 x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

// The polynomials that decide about a tunnel, on one axis, as integers.
struct Determinants {
    __int128 d0, d1, mixed, growth0, growth1;

    Determinants(const std::array<std::int64_t, 8>& f, unsigned axis) {
        const unsigned across = 1u << axis, u = 1u << (axis + 1) % 3, v = 1u << (axis + 2) % 3;
        const __int128 p00 = f[0], p10 = f[u], p01 = f[v], p11 = f[u | v], q00 = f[across],
                       q10 = f[across | u], q01 = f[across | v], q11 = f[across | u | v];
        d0 = p00 * p11 - p01 * p10;
        d1 = q00 * q11 - q01 * q10;
        mixed = p00 * q11 + p11 * q00 - p01 * q10 - p10 * q01;
        growth0 = p00 + p11 - p01 - p10;
        growth1 = q00 + q11 - q01 - q10;
    }
    // Half of what the hyperdeterminant grows by with the values.
    __int128 level() const { return mixed * (growth0 + growth1) - 2 * (d0 * growth1 + d1 * growth0); }
};

// Ties are decided as if the values were higher by an infinitely small amount.
bool has_waist(const std::array<std::int64_t, 8>& f) {
    const auto sign_or = [](__int128 value, __int128 growth) {
        return sign(value) != 0 ? sign(value) : sign(growth);
    };
    for (unsigned axis = 0; axis < 3; ++axis) {
        const Determinants d(f, axis);
        const int s = sign_or(d.d0, d.growth0);
        if (s == 0 || sign_or(d.d1, d.growth1) != s || sign_or(d.mixed, d.growth0 + d.growth1) != -s)
            return false;
    }
    const Determinants d(f, 0);
    const int hyperdeterminant = sign_or(d.mixed * d.mixed - 4 * d.d0 * d.d1, d.level());
    return hyperdeterminant > 0 || (hyperdeterminant == 0 && d.growth0 != d.growth1);
}

// Small integers or halves, as integers.
std::optional<std::array<std::int64_t, 8>> as_integers(const Corners& f) {
    std::array<std::int64_t, 8> result{};
    for (std::size_t v = 0; v < 8; ++v) {
        const double twice = 2 * f[v];
        if (!(std::abs(twice) <= 1 << 18) || twice != std::round(twice)) return {};
        result[v] = std::llround(twice);
    }
    return result;
}

// Which two loops a tunnel joins; the first is the second if there is none.
using Tunnel = std::pair<std::size_t, std::size_t>;

Tunnel tunnel_of(const std::array<std::int64_t, 8>& f, const std::vector<std::vector<int>>& loops) {
    if (loops.size() < 2 || !has_waist(f)) return {0, 0};
    if (loops.size() == 2) return {0, 1};
    // The loop of six points is joined with the triangle around the corner that
    // is inside, or the one outside.
    const bool joins_inside = Determinants(f, 0).level() >= 0;
    Tunnel tunnel{0, 0};
    for (std::size_t i = 0; i < loops.size(); ++i) {
        if (loops[i].size() == 6) tunnel.first = i;
        for (unsigned v = 0; v < 8 && loops[i].size() == 3; ++v) {
            std::set<int> around;
            for (unsigned axis = 0; axis < 3; ++axis) around.insert(edge_between(v, v ^ 1u << axis));
            if (around == std::set<int>(loops[i].begin(), loops[i].end()) && (f[v] >= 0) == joins_inside)
                tunnel.second = i;
        }
    }
    return tunnel;
}

// The triangles of a mesh in one cell.
class Patch {
  public:
    void add(const Mesh& mesh, const Index& cell, const Triangle& triangle) {
        std::array<int, 3> nodes{};
        for (std::size_t c = 0; c < 3; ++c) nodes[c] = node(mesh.points[triangle[c]], triangle[c], cell);
        for (std::size_t c = 0; c < 3; ++c) sides_.insert({nodes[c], nodes[(c + 1) % 3]});
        ++triangles_;
    }
    // The sides that only one triangle has.
    std::set<Line> border() const {
        std::set<Line> result;
        for (const auto& [a, b] : sides_) {
            if (sides_.count({b, a}) == 0) result.insert({a, b});
        }
        return result;
    }
    int euler_characteristic() const {
        std::set<int> nodes;
        int edges = 0;
        for (const auto& [a, b] : sides_) {
            nodes.insert(a);
            edges += a < b || sides_.count({b, a}) == 0 ? 1 : 0;
        }
        return static_cast<int>(nodes.size()) - edges + triangles_;
    }
    // The nodes that triangles connect with this one.
    std::set<int> connected(int first) const {
        std::set<int> found{first};
        for (std::size_t before = 0; before != found.size();) {
            before = found.size();
            for (const auto& [a, b] : sides_) {
                if (found.count(a) != 0) found.insert(b);
            }
        }
        return found;
    }

  private:
    // The edge that the point is on, or a number of its own for a point inside the cell.
    static int node(const Vec3f& p, std::uint32_t id, const Index& cell) {
        int edge = 0, between = 0;
        for (std::size_t axis = 3; axis-- > 0;) {
            const double in_cell = static_cast<double>(p[axis]) - static_cast<double>(cell[axis]);
            EXPECT_TRUE(in_cell >= 0 && in_cell <= 1);
            const bool is_between = in_cell > 0 && in_cell < 1;
            between += is_between ? 1 : 0;
            edge = 3 * edge + (is_between ? 1 : in_cell == 0 ? 0 : 2);
        }
        return between == 1 ? edge : 27 + static_cast<int>(id);
    }

    std::set<Line> sides_;
    int triangles_ = 0;
};

// No triangle lies in a face, so its middle is inside its cell.
std::map<Index, Patch> patches_of(const Mesh& mesh) {
    std::map<Index, Patch> patches;
    for (const Triangle& t : mesh.triangles) {
        Index cell{};
        for (std::size_t a = 0; a < 3; ++a) {
            double middle = 0;
            for (const std::uint32_t p : t) middle += static_cast<double>(mesh.points[p][a]) / 3;
            cell[a] = static_cast<std::int64_t>(std::floor(middle));
        }
        patches[cell].add(mesh, cell, t);
    }
    return patches;
}

Corners corners_of(const Volume& volume, double isovalue, const Index& cell) {
    const auto& dims = volume.geometry().dims;
    Corners f{};
    for (std::size_t v = 0; v < 8; ++v) {
        const std::int64_t x = cell[0] + static_cast<std::int64_t>(v & 1),
                           y = cell[1] + static_cast<std::int64_t>(v >> 1 & 1),
                           z = cell[2] + static_cast<std::int64_t>(v >> 2);
        f[v] = std::numeric_limits<double>::quiet_NaN();
        if (x < 0 || y < 0 || z < 0 || x >= dims[0] || y >= dims[1] || z >= dims[2]) continue;
        const double sample = visit_sample_type(volume.type(), [&](auto type) {
            return static_cast<double>(volume.samples<decltype(type)>()[(z * dims[1] + y) * dims[0] + x]);
        });
        if (std::isfinite(sample)) f[v] = sample - isovalue;
    }
    return f;
}

struct Seen {
    int joined_loops = 0, of_three_loops = 0;
};

// Compares the surface in a cell with its lines, loops and tunnel.
void compare(const Patch& patch, const Corners& f, Seen& seen) {
    const std::set<Line> lines = lines_of(f);
    ASSERT_EQ(patch.border(), lines);
    const auto loops = loops_of(lines);
    Tunnel found{0, 0};
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const std::set<int> connected = patch.connected(loops[i].front());
        for (std::size_t k = i + 1; k < loops.size(); ++k) {
            if (connected.count(loops[k].front()) == 0) continue;
            ASSERT_EQ(found, (Tunnel{0, 0})) << "more than one tunnel";
            found = {i, k};
        }
    }
    const bool has_tunnel = found.first != found.second;
    ASSERT_EQ(patch.euler_characteristic(), static_cast<int>(loops.size()) - (has_tunnel ? 2 : 0));
    if (std::any_of(f.begin(), f.end(), [](double v) { return std::isnan(v); })) {
        ASSERT_FALSE(has_tunnel);
    } else if (const auto integers = as_integers(f)) {
        const auto [a, b] = tunnel_of(*integers, loops);
        ASSERT_EQ(found, (Tunnel{std::min(a, b), std::max(a, b)}));
    }
    seen.joined_loops += has_tunnel ? 1 : 0;
    seen.of_three_loops += has_tunnel && loops.size() == 3 ? 1 : 0;
}

void compare_all(const Volume& volume, double isovalue, bool closed, Seen& seen) {
    const Mesh mesh = extract_isosurface(
        volume, isovalue, {.normals = false, .closed = closed, .topology = true, .threads = 1});
    ASSERT_EQ(manifold_fault(mesh, !closed), "");
    const std::map<Index, Patch> patches = patches_of(mesh);
    const auto& dims = volume.geometry().dims;
    const std::int64_t low = closed ? -1 : 0, high = closed ? 0 : 1;
    std::size_t active = 0;
    for (std::int64_t z = low; z + high < dims[2]; ++z) {
        for (std::int64_t y = low; y + high < dims[1]; ++y) {
            for (std::int64_t x = low; x + high < dims[0]; ++x) {
                const Corners f = corners_of(volume, isovalue, {x, y, z});
                const auto patch = patches.find({x, y, z});
                if (patch == patches.end()) {
                    ASSERT_TRUE(lines_of(f).empty());
                    continue;
                }
                ++active;
                compare(patch->second, f, seen);
                if (testing::Test::HasFatalFailure()) return;
            }
        }
    }
    ASSERT_EQ(active, patches.size()) << "there are triangles outside the grid";
}

// Exact topology moves no point and takes none away: it only adds some inside cells.
void compare_points(const Volume& volume, double isovalue, bool closed) {
    const auto points = [&](bool topology) {
        const Mesh mesh =
            extract_isosurface(volume, isovalue, {.normals = false, .closed = closed, .topology = topology});
        std::set<PointBits> on_edges;
        for (const Vec3f& p : mesh.points) {
            const auto whole = std::count_if(p.begin(), p.end(), [](float c) { return c == std::round(c); });
            if (whole == 2) on_edges.insert(bits_of(p));
        }
        return on_edges;
    };
    ASSERT_EQ(points(true), points(false));
}

TEST(ExactCells, AreThoseOfStraightforwardMarchingCubes) {
    Random random(31);
    Seen seen;
    for (int i = 0; i < 1500; ++i) {
        const RandomGrid g = random_grid(random);
        for (const bool closed : {false, true}) {
            compare_all(g.volume, g.isovalue, closed, seen);
            ASSERT_FALSE(HasFatalFailure()) << "grid " << i;
            if (i % 10 == 0) compare_points(g.volume, g.isovalue, closed);
        }
    }
    EXPECT_GT(seen.joined_loops, 100);
}

// Cells whose corners alternate have up to four loops, and a tunnel can join two of three.
TEST(ExactCells, OfACheckerboardAreToo) {
    Random random(32);
    std::uniform_int_distribution<int> inside(0, 40), outside(-40, -1);
    Seen seen;
    for (int i = 0; i < 8000; ++i) {
        const Volume volume = sampled<std::int16_t>(grid(2, 2, 2), [&](auto x, auto y, auto z) {
            return (x + y + z) % 2 == 0 ? inside(random) : outside(random);
        });
        compare_all(volume, 0, i % 2 == 0, seen);
        ASSERT_FALSE(HasFatalFailure()) << "cell " << i;
    }
    EXPECT_GT(seen.of_three_loops, 20);
}

}  // namespace
}  // namespace marrow::test
