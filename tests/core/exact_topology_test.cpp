// Surfaces with exact topology have the topology of the trilinear interpolant, which is computed here by Morse
// theory, without cases, faces' decisions or triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "base/disjoint_sets.h"
#include "core/marching_cubes/cell_topology.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using internal::CellTopology;
using internal::CellValues;

const IsosurfaceOptions kExact{.normals = false, .closed = true, .topology = true, .threads = 1};

// A cube of samples minus the isovalue. Those at its border are outside, so that the surface is closed.
struct Cube {
    int n;
    std::vector<std::int64_t> f;

    explicit Cube(int size) : n(size), f(static_cast<std::size_t>(size * size * size)) {}
    std::int64_t& at(int x, int y, int z) { return f[static_cast<std::size_t>((z * n + y) * n + x)]; }
    std::int64_t at(int x, int y, int z) const { return f[static_cast<std::size_t>((z * n + y) * n + x)]; }
    std::int64_t at(const std::array<int, 3>& p) const { return at(p[0], p[1], p[2]); }
    bool is_border(int x, int y, int z) const {
        const auto [low, high] = std::minmax({x, y, z});
        return low == 0 || high == n - 1;
    }
    // Calls f(x, y, z) for the first `size` positions along each axis.
    template <class F>
    static void for_each(int size, const F& visit) {
        for (int z = 0; z < size; ++z) {
            for (int y = 0; y < size; ++y) {
                for (int x = 0; x < size; ++x) visit(x, y, z);
            }
        }
    }
    Mesh surface() const {
        const Volume volume = sampled<std::int32_t>(grid(n, n, n), [&](auto x, auto y, auto z) {
            return at(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
        });
        return extract_isosurface(volume, 0, kExact);
    }
    std::array<std::int64_t, 8> cell(int x, int y, int z) const {
        std::array<std::int64_t, 8> corners;
        for (int v = 0; v < 8; ++v)
            corners[static_cast<std::size_t>(v)] = at(x + (v & 1), y + (v >> 1 & 1), z + (v >> 2));
        return corners;
    }
};

using Wide = __int128;

int sign(Wide x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

// What the samples add to the Euler characteristic of the inside: the values around a sample on its three axes
// that are higher are where its upper link begins.
int chi_of_sample(const Cube& cube, int x, int y, int z) {
    const std::int64_t f = cube.at(x, y, z);
    if (f < 0) return 0;
    int product = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        int higher = 0;
        for (const int side : {-1, 1}) {
            std::array<int, 3> p{x, y, z};
            p[axis] += side;
            higher += cube.at(p) > f ? 1 : 0;
        }
        product *= 1 - higher;
    }
    return product;
}

// The same for the saddle of the face at (x, y, z) across an axis.
int chi_of_face(const Cube& cube, int x, int y, int z, std::size_t axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto value = [&](int i, int j, int across) {
        std::array<int, 3> p{x, y, z};
        p[u] += i;
        p[v] += j;
        p[axis] += across;
        return static_cast<Wide>(cube.at(p));
    };
    const Wide f00 = value(0, 0, 0), f10 = value(1, 0, 0), f01 = value(0, 1, 0), f11 = value(1, 1, 0);
    if (!(std::min(f00, f11) > std::max(f10, f01)) && !(std::max(f00, f11) < std::min(f10, f01))) return 0;
    const Wide al = f00 + f11 - f10 - f01, d = f00 * f11 - f10 * f01;
    if (sign(d) * sign(al) < 0) return 0;
    // The saddle is at (s, t) / al. All is multiplied by al squared.
    const Wide s = f00 - f01, t = f00 - f10;
    int rises = 0;
    for (const int side : {-1, 1}) {
        const Wide beside = value(0, 0, side) * (al - s) * (al - t) + value(1, 0, side) * s * (al - t) +
                            value(0, 1, side) * (al - s) * t + value(1, 1, side) * s * t;
        rises += sign(beside - d * al);
    }
    return rises == 2 ? 1 : rises == -2 ? -1 : 0;
}

// The same for the saddles within a cell.
int chi_of_cell(const std::array<std::int64_t, 8>& f) {
    using Real = long double;
    const auto k = [&](std::initializer_list<std::pair<std::size_t, int>> terms) {
        std::int64_t sum = 0;
        for (const auto& [corner, factor] : terms) sum += factor * f[corner];
        return static_cast<Real>(sum);
    };
    const Real one = k({{0, 1}}), kx = k({{1, 1}, {0, -1}}), ky = k({{2, 1}, {0, -1}}),
               kz = k({{4, 1}, {0, -1}}), kxy = k({{3, 1}, {1, -1}, {2, -1}, {0, 1}}),
               kxz = k({{5, 1}, {1, -1}, {4, -1}, {0, 1}}), kyz = k({{6, 1}, {2, -1}, {4, -1}, {0, 1}}),
               h = k({{7, 1}, {6, -1}, {5, -1}, {3, -1}, {1, 1}, {2, 1}, {4, 1}, {0, -1}});
    const Real a = kxy * kxz - h * kx, b = kxy * kyz - h * ky, c = kxz * kyz - h * kz;
    if (h == 0 || !(a * b * c > 0)) return 0;
    int chi = 0;
    for (const int s : {-1, 1}) {
        const Real root = s * std::sqrt(a * b * c);
        const Real x = (root / a - kyz) / h, y = (root / b - kxz) / h, z = (root / c - kxy) / h;
        if (!(x > 0 && x < 1 && y > 0 && y < 1 && z > 0 && z < 1)) continue;
        const Real value =
            one + kx * x + ky * y + kz * z + kxy * x * y + kxz * x * z + kyz * y * z + h * x * y * z;
        if (value >= 0) chi -= s;
    }
    return chi;
}

// The Euler characteristic of the inside of the trilinear interpolant: a sum over its critical points. \pre no
// sample equals a neighbour, and no critical value is 0
int chi_by_morse_theory(const Cube& cube) {
    int chi = 0;
    Cube::for_each(cube.n - 1, [&](int x, int y, int z) {
        if (!cube.is_border(x, y, z)) chi += chi_of_sample(cube, x, y, z);
        chi += chi_of_cell(cube.cell(x, y, z));
        // The faces in the border of the cube have no inside saddle.
        if (x > 0) chi += chi_of_face(cube, x, y, z, 0);
        if (y > 0) chi += chi_of_face(cube, x, y, z, 1);
        if (z > 0) chi += chi_of_face(cube, x, y, z, 2);
    });
    return chi;
}

// Moves each value by a small amount of its own, without moving any over 0. Then no sample equals a neighbour, and
// nothing is a tie. Ties go to the inside, so values go up.
Cube without_ties(const Cube& cube, Random& random) {
    std::vector<std::int64_t> amounts(cube.f.size());
    std::iota(amounts.begin(), amounts.end(), -static_cast<std::int64_t>(amounts.size() / 2));
    std::shuffle(amounts.begin(), amounts.end(), random);
    Cube moved = cube;
    for (std::size_t i = 0; i < amounts.size(); ++i) moved.f[i] = (cube.f[i] << 26) + (1 << 14) + amounts[i];
    return moved;
}

// The Euler characteristic where there may be ties: that of most of three ways to undo them.
int chi_with_ties(const Cube& cube, Random& random) {
    const int a = chi_by_morse_theory(without_ties(cube, random)),
              b = chi_by_morse_theory(without_ties(cube, random));
    return a == b ? a : chi_by_morse_theory(without_ties(cube, random));
}

// The pieces of the inside and of the outside of a cube, and the Euler characteristic of the inside, counted cell
// by cell from what is decided for each.
struct CountedCells {
    int components = 0;  // of the surface
    int chi = 0;
    int tunnels = 0, tunnels_of_three_loops = 0;
};

// Whether the inside corners of an ambiguous face are joined.
bool is_joined(std::int64_t inside_a, std::int64_t inside_b, std::int64_t outside_a, std::int64_t outside_b) {
    return static_cast<Wide>(inside_a) * inside_b >= static_cast<Wide>(outside_a) * outside_b;
}

// Whether a tunnel in the cell is one of the inside: Cayley's hyperdeterminant grows with the values.
bool joins_inside(const std::array<std::int64_t, 8>& f) {
    const Wide d0 = static_cast<Wide>(f[0]) * f[6] - static_cast<Wide>(f[2]) * f[4],
               d1 = static_cast<Wide>(f[1]) * f[7] - static_cast<Wide>(f[3]) * f[5],
               mixed = static_cast<Wide>(f[0]) * f[7] + static_cast<Wide>(f[6]) * f[1] -
                       static_cast<Wide>(f[4]) * f[3] - static_cast<Wide>(f[2]) * f[5];
    const std::int64_t al0 = f[0] + f[6] - f[2] - f[4], al1 = f[1] + f[7] - f[3] - f[5];
    return mixed * (al0 + al1) - 2 * (d0 * al1 + d1 * al0) >= 0;
}

using Corners = std::array<std::int64_t, 8>;

// How the corners of a cell are connected: inside and outside ones along edges and across the diagonals of faces.
struct ConnectedCorners {
    std::array<std::uint32_t, 8> sets{0, 1, 2, 3, 4, 5, 6, 7};
    // Of the inside on the cell's boundary: its Euler characteristic.
    int boundary_chi = 0;

    explicit ConnectedCorners(const Corners& f) {
        const auto inside = [&](std::size_t v) { return f[v] >= 0; };
        for (std::size_t v = 0; v < 8; ++v) boundary_chi += inside(v) ? 1 : 0;
        for (const auto& [a, b] : internal::kEdgeCorners) {
            if (inside(a) != inside(b)) continue;
            internal::unite(sets, a, b);
            boundary_chi -= inside(a) ? 1 : 0;
        }
        for (const auto& ring : internal::kFaceCorners) {
            if (inside(ring[0]) && inside(ring[1]) && inside(ring[2]) && inside(ring[3])) ++boundary_chi;
            const std::size_t in = inside(ring[0]) ? 0 : 1, out = 1 - in;
            if (!inside(ring[in]) || !inside(ring[in + 2]) || inside(ring[out]) || inside(ring[out + 2]))
                continue;
            const bool joined = is_joined(f[ring[in]], f[ring[in + 2]], f[ring[out]], f[ring[out + 2]]);
            boundary_chi -= joined ? 1 : 0;
            internal::unite(sets, ring[joined ? in : out], ring[joined ? in + 2 : out + 2]);
        }
    }
    int pieces(const Corners& f, bool of_inside) const {
        int count = 0;
        for (std::uint32_t v = 0; v < 8; ++v) count += sets[v] == v && (f[v] >= 0) == of_inside ? 1 : 0;
        return count;
    }
    // A tunnel connects all inside corners or all outside ones.
    void add_tunnel(const Corners& f) {
        const bool inside = joins_inside(f);
        for (std::size_t a = 0; a < 8; ++a) {
            for (std::size_t b = 0; b < a; ++b) {
                if ((f[a] >= 0) == inside && (f[b] >= 0) == inside) internal::unite(sets, a, b);
            }
        }
    }
};

CellTopology decided(const Corners& f, unsigned* cell_case = nullptr) {
    CellValues values;
    unsigned bits = 0;
    for (std::size_t v = 0; v < 8; ++v) {
        values[v] = static_cast<double>(f[v]);
        bits |= (f[v] >= 0 ? 1u : 0u) << v;
    }
    if (cell_case != nullptr) *cell_case = bits;
    return internal::decide_topology(bits, values);
}

CountedCells count_cells(const Cube& cube) {
    CountedCells result;
    std::vector<std::uint32_t> sets(cube.f.size());
    std::iota(sets.begin(), sets.end(), 0u);
    int pieces = static_cast<int>(sets.size());
    Cube::for_each(cube.n - 1, [&](int x, int y, int z) {
        const Corners f = cube.cell(x, y, z);
        const CellTopology topology = decided(f);
        ConnectedCorners connected(f);
        const int tunnels = topology.has_tunnel ? 1 : 0;
        result.chi += connected.pieces(f, true) - tunnels - connected.boundary_chi;
        result.tunnels += tunnels;
        result.tunnels_of_three_loops += topology.shape->loops == 3 ? tunnels : 0;
        if (tunnels > 0) connected.add_tunnel(f);
        const auto number = [&](std::uint32_t v) {
            const int vx = x + static_cast<int>(v & 1), vy = y + static_cast<int>(v >> 1 & 1),
                      vz = z + static_cast<int>(v >> 2);
            return static_cast<std::size_t>((vz * cube.n + vy) * cube.n + vx);
        };
        for (std::uint32_t v = 0; v < 8; ++v) {
            const auto other = internal::representative(connected.sets, v);
            pieces -= internal::unite(sets, number(v), number(other)) ? 1 : 0;
        }
    });
    // The samples, edges and faces between the cells. Nothing of the inside is at the cube's border.
    Cube::for_each(cube.n - 1, [&](int x, int y, int z) {
        const Corners f = cube.cell(x, y, z);
        const auto inside = [&](std::size_t v) { return f[v] >= 0 ? 1 : 0; };
        result.chi += inside(0) - inside(0) * (inside(1) + inside(2) + inside(4));
        for (const auto& [u, v] : {std::pair<std::size_t, std::size_t>{1, 2}, {1, 4}, {2, 4}}) {
            const int corners = inside(0) + inside(u) + inside(v) + inside(u | v);
            result.chi += corners == 4 ? 1 : 0;
            if (corners != 2 || inside(0) != inside(u | v)) continue;
            const bool joined = inside(0) == 1 ? is_joined(f[0], f[u | v], f[u], f[v])
                                               : is_joined(f[u], f[v], f[0], f[u | v]);
            result.chi -= joined ? 1 : 0;
        }
    });
    result.components = pieces - 1;
    return result;
}

// Cubes whose cells are difficult in different ways.
enum class Kind { uniform, checkerboard, signs, small };

Cube random_cube(Kind kind, int inner, Random& random) {
    Cube cube(inner + 2);
    const auto draw = [&](int x, int y, int z) -> std::int64_t {
        constexpr std::int64_t kMost = 1 << 26;
        switch (kind) {
            case Kind::uniform:
                return static_cast<std::int64_t>(random() % (2 * kMost)) - kMost;
            case Kind::checkerboard: {
                const auto size = static_cast<std::int64_t>(random() % kMost);
                const bool flipped = random() % 5 == 0;
                return ((x + y + z) % 2 == 0) != flipped ? size : -1 - size;
            }
            case Kind::signs:
                return static_cast<std::int64_t>(random() % 3) - 1;
            case Kind::small:
                break;
        }
        return static_cast<std::int64_t>(random() % 5) - 2;
    };
    const bool has_ties = kind == Kind::signs || kind == Kind::small;
    Cube::for_each(cube.n, [&](int x, int y, int z) {
        cube.at(x, y, z) = !cube.is_border(x, y, z) ? draw(x, y, z)
                           : has_ties               ? -5
                                                    : -(std::int64_t{1} << 27) - (x * 31 + y * 7 + z);
    });
    return cube;
}

int times_long() {
    return std::getenv("MARROW_TEST_LONG") != nullptr ? 10 : 1;
}

class ExactTopology : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ExactTopology, testing::Range(0, 10));

// In all 100,000 cubes, or 1,000,000.
TEST_P(ExactTopology, IsThatOfTheTrilinearInterpolant) {
    Random random(static_cast<std::uint64_t>(GetParam()));
    int tunnels = 0, of_three_loops = 0;
    for (int i = 0; i < 2500 * times_long(); ++i) {
        for (const Kind kind : {Kind::uniform, Kind::checkerboard, Kind::signs, Kind::small}) {
            const Cube cube = random_cube(kind, i % 50 == 0 ? 9 : 3 + i % 3, random);
            const Mesh mesh = cube.surface();
            ASSERT_EQ(manifold_fault(mesh), "") << "cube " << i;
            const MeshMeasures m = measure(mesh);
            const bool has_ties = kind == Kind::signs || kind == Kind::small;
            ASSERT_EQ(m.euler_characteristic,
                      2 * (has_ties ? chi_with_ties(cube, random) : chi_by_morse_theory(cube)))
                << "cube " << i << " of kind " << static_cast<int>(kind);
            const CountedCells cells = count_cells(cube);
            ASSERT_EQ(m.euler_characteristic, 2 * cells.chi) << "cube " << i;
            ASSERT_EQ(m.components, cells.components) << "cube " << i;
            tunnels += cells.tunnels;
            of_three_loops += cells.tunnels_of_three_loops;
        }
    }
    EXPECT_GT(tunnels, 1000);
    std::printf("%d tunnels, %d of three loops\n", tunnels, of_three_loops);
}

}  // namespace
}  // namespace marrow::test
