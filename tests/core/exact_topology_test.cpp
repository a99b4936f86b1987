// Surfaces with exact topology have the topology of the trilinear interpolant, which is computed here by
// Morse theory, without cases, faces' decisions or triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <set>
#include <stdexcept>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>

#include "base/disjoint_sets.h"
#include "core/marching_cubes/cell_topology.h"
#include "support/exact_numbers.h"
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

// Thrown where critical points are not isolated, or where one has the value 0.
struct Degenerate {};

template <class Number>
int sign_of(const Number& x) {
    const int sign = x.sign();
    if (sign == 0) throw Degenerate();
    return sign;
}

// What the samples add to the Euler characteristic of the inside: the values around a sample on its three
// axes that are higher are where its upper link begins.
int chi_of_sample(const Cube& cube, int x, int y, int z) {
    const std::int64_t f = cube.at(x, y, z);
    if (f < 0) return 0;
    int product = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        int higher = 0;
        for (const int side : {-1, 1}) {
            std::array<int, 3> p{x, y, z};
            p[axis] += side;
            if (cube.at(p) == f) throw Degenerate();
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
        return cube.at(p);
    };
    const std::int64_t c00 = value(0, 0, 0), c10 = value(1, 0, 0), c01 = value(0, 1, 0), c11 = value(1, 1, 0);
    if (!(std::min(c00, c11) > std::max(c10, c01)) && !(std::max(c00, c11) < std::min(c10, c01))) return 0;
    return decide_exactly([&]<class Number>() {
        const Number f00(c00), f10(c10), f01(c01), f11(c11);
        const Number al = f00 + f11 - f10 - f01, d = f00 * f11 - f10 * f01;
        if (sign_of(d) * al.sign() < 0) return 0;
        // The saddle is at (s, t) / al. All is multiplied by al squared.
        const Number s = f00 - f01, t = f00 - f10;
        int rises = 0;
        for (const int side : {-1, 1}) {
            const Number beside =
                Number(value(0, 0, side)) * (al - s) * (al - t) + Number(value(1, 0, side)) * s * (al - t) +
                Number(value(0, 1, side)) * (al - s) * t + Number(value(1, 1, side)) * s * t;
            rises += sign_of<Number>(beside - d * al);
        }
        return rises == 2 ? 1 : rises == -2 ? -1 : 0;
    });
}

// The same for the saddles within a cell. With f = one + kx x + ... + kxy xy + ... + h xyz, these are at
// h x + kyz = sD/A, h y + kxz = sD/B, h z + kxy = sD/C for s = -1 and 1, where D is the square root of ABC,
// and have the value (E - 2 sD) / h^2.
template <class Number>
int chi_of_saddles(const std::array<std::int64_t, 8>& corners) {
    const auto f = [&](std::size_t v) { return Number(corners[v]); };
    const Number one = f(0), kx = f(1) - f(0), ky = f(2) - f(0), kz = f(4) - f(0);
    const Number kxy = f(3) - f(1) - ky, kxz = f(5) - f(1) - kz, kyz = f(6) - f(2) - kz;
    const Number h = f(7) - f(6) - f(5) + f(4) - kxy;
    const Number a = kxy * kxz - h * kx, b = kxy * kyz - h * ky, c = kxz * kyz - h * kz;
    const int sign_a = sign_of(a), sign_b = sign_of(b), sign_c = sign_of(c), sign_h = sign_of(h);
    if (sign_a * sign_b * sign_c < 0) return 0;
    // The sign of p + sD, if difference() has that of p^2 - D^2.
    const auto sign_of_sum = [](int sign_p, int s, const auto& difference) {
        return sign_p * s >= 0 ? s : sign_p * difference();
    };
    // Whether 0 < x < 1, where h x + k = sD/A: whether sD/A - k and sD/A - k - h have the signs of h and -h.
    const auto is_within = [&](int s, int sign_of_a, const Number& k, const Number& of_a,
                               const Number& others) {
        const auto sign_after = [&](const Number& shift) {
            return sign_of_a * sign_of_sum(-sign_of_a * shift.sign(), s, [&] {
                       return sign_of_a * sign_of<Number>(of_a * shift * shift - others);
                   });
        };
        return sign_after(k) == sign_h && sign_after(k + h) == -sign_h;
    };
    const Number e = one * h * h - h * (kx * kyz + ky * kxz + kz * kxy) + kxy * kxz * kyz + kxy * kxz * kyz;
    const Number bc = b * c, ac = a * c, ab = a * b;
    int chi = 0;
    for (const int s : {-1, 1}) {
        if (!is_within(s, sign_a, kyz, a, bc) || !is_within(s, sign_b, kxz, b, ac) ||
            !is_within(s, sign_c, kxy, c, ab))
            continue;
        if (sign_of_sum(e.sign(), -s, [&] { return sign_of<Number>(e * e - Number(4) * a * bc); }) > 0)
            chi -= s;
    }
    return chi;
}

int chi_of_cell(const std::array<std::int64_t, 8>& f) {
    return decide_exactly([&]<class Number>() { return chi_of_saddles<Number>(f); });
}

// The Euler characteristic of the inside of the trilinear interpolant: a sum over its critical points.
// \throw Degenerate
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

// Small values, all raised by 2^-15, so that ties go to the inside, and then moved by random amounts of less
// than 2^-45, so that critical points are isolated. In units of 2^-60.
//
// Neither changes which critical values are at least 0, and so it does not change the topology of the inside.
// Raising: the values f have magnitudes of at most 5. The critical values of faces are d / al, with integers
// |al| <= 20. Those of cells are (E - 2 sD) / h^2, and their product is H / h^2 with the integer
// H = (E^2 - 4 D^2) / h^2. So one that is not 0 is at least 1 / (|E| + 2 D) > 1 / 18000. Moving: a critical
// value can pass 0 only where the determinant of a face or H does. Raised by e, these are polynomials in e
// with integers as coefficients. So they are 0 for every e or at least e^2 / 2, and the amounts change them
// by less, H by 12,000 amounts at most. If they are 0 for every e, the interpolant varies in fewer
// directions, and its critical values are ratios of small integers.
Cube without_ties(const Cube& cube, Random& random) {
    Cube moved = cube;
    for (std::int64_t& f : moved.f) {
        const auto amount = static_cast<std::int64_t>(random() >> 48) - (1 << 15);
        f = f * (std::int64_t{1} << 60) + (std::int64_t{1} << 45) + amount;
    }
    return moved;
}

// The Euler characteristic where there may be ties.
int chi_with_ties(const Cube& cube, Random& random) {
    for (int draw = 0; draw < 100; ++draw) {
        try {
            return chi_by_morse_theory(without_ties(cube, random));
        } catch (const Degenerate&) {  // by accident
        }
    }
    throw std::runtime_error("a hundred draws were degenerate");
}

// The pieces of the inside and of the outside of a cube, and the Euler characteristic of the inside, counted
// cell by cell from what is decided for each.
struct CountedCells {
    int components = 0;  // of the surface
    int chi = 0;
    int tunnels = 0, tunnels_of_three_loops = 0;
};

using Wide = __int128;

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

// How the corners of a cell are connected: inside and outside ones along edges and
// across the diagonals of faces.
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
        const int tunnels = topology.has_tunnel() ? 1 : 0;
        result.chi += connected.pieces(f, true) - tunnels - connected.boundary_chi;
        result.tunnels += tunnels;
        result.tunnels_of_three_loops += topology.shape().loops == 3 ? tunnels : 0;
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
    EXPECT_GT(of_three_loops, 100);
}

// A cell of which each corner is inside or outside at random, or in turn.
Corners random_corners(bool alternate, Random& random) {
    Corners f;
    for (unsigned v = 0; v < 8; ++v) {
        const auto size = static_cast<std::int64_t>(random() % (1 << 20));
        const bool inside = alternate ? std::popcount(v) % 2 == 0 : random() % 2 == 0;
        f[v] = inside ? size : -1 - size;
    }
    return f;
}

// Calls f(order) for the 48 symmetries of a cell: corner v goes to corner order[v].
template <class F>
void for_each_symmetry(const F& visit) {
    std::array<unsigned, 3> axes{0, 1, 2};
    do {
        for (unsigned mirrored = 0; mirrored < 8; ++mirrored) {
            std::array<std::size_t, 8> order;
            for (unsigned v = 0; v < 8; ++v) {
                unsigned to = 0;
                for (unsigned a = 0; a < 3; ++a) to |= (v >> a & 1) << axes[a];
                order[v] = to ^ mirrored;
            }
            visit(order);
        }
    } while (std::next_permutation(axes.begin(), axes.end()));
}

TEST(ExactTopologyOfCells, DoesNotDependOnAxesOrSides) {
    Random random(1);
    int tunnels = 0;
    for (int i = 0; i < 20000; ++i) {
        const Corners f = random_corners(i % 2 == 0, random);
        const CellTopology topology = decided(f);
        tunnels += topology.has_tunnel() ? 1 : 0;
        const auto expect_same = [&](const CellTopology& other) {
            ASSERT_EQ(other.shape().loops, topology.shape().loops) << i;
            ASSERT_EQ(other.has_tunnel(), topology.has_tunnel()) << i;
            ASSERT_EQ(other.shape().has_fan, topology.shape().has_fan) << i;
            ASSERT_EQ(other.triangles(), topology.triangles()) << i;
        };
        for_each_symmetry([&](const std::array<std::size_t, 8>& order) {
            Corners moved;
            for (std::size_t v = 0; v < 8; ++v) moved[order[v]] = f[v];
            expect_same(decided(moved));
        });
        // Inside and outside exchanged; 2 f + 1 is never a tie.
        Corners doubled, negated;
        for (std::size_t v = 0; v < 8; ++v) doubled[v] = 2 * f[v] + 1, negated[v] = -doubled[v];
        ASSERT_EQ(decided(doubled).has_tunnel(), decided(negated).has_tunnel()) << i;
        ASSERT_EQ(decided(doubled).shape().loops, decided(negated).shape().loops) << i;
    }
    EXPECT_GT(tunnels, 50);
}

// The open surface in one cell: L loops are its borders, each bounds a disc, and a tunnel joins two discs.
TEST(ExactTopologyOfCells, HasTheLoopsAndTunnelsThatAreDecided) {
    Random random(2);
    for (int i = 0; i < 20000; ++i) {
        const Corners f = random_corners(i % 2 == 0, random);
        const CellTopology topology = decided(f);
        const Volume volume = sampled<float>(grid(2, 2, 2), [&](auto x, auto y, auto z) {
            return f[static_cast<std::size_t>(x + 2 * y + 4 * z)];
        });
        const Mesh mesh = extract_isosurface(volume, 0, {.topology = true, .threads = 1});
        ASSERT_EQ(manifold_fault(mesh, true), "") << i;
        const MeshMeasures m = measure(mesh);
        const int loops = topology.shape().loops, tunnels = topology.has_tunnel() ? 1 : 0;
        ASSERT_EQ(m.euler_characteristic, loops - 2 * tunnels) << i;
        ASSERT_EQ(m.components, loops - tunnels) << i;
        ASSERT_EQ(m.boundary_edges, std::popcount(topology.shape().crossed)) << i;
    }
}

// A lattice of points in a cell. The interpolant is linear between two neighbours, so if both are inside, all
// between them is: points that are connected on the lattice are connected in the cell.
TEST(ExactTopologyOfCells, ConnectsWhatALatticeConnects) {
    constexpr int kPoints = 30;
    Random random(3);
    int agree = 0, cells = 0, tunnels = 0;
    for (int i = 0; i < 1500; ++i) {
        const Corners f = random_corners(i % 2 == 0, random);
        const CellTopology topology = decided(f);
        ConnectedCorners connected(f);
        if (topology.has_tunnel()) connected.add_tunnel(f);
        tunnels += topology.has_tunnel() ? 1 : 0;
        Cube lattice(kPoints);
        const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
        Cube::for_each(kPoints, [&](int x, int y, int z) {
            const double u = x / (kPoints - 1.0), v = y / (kPoints - 1.0), w = z / (kPoints - 1.0);
            double on_x[4];
            for (std::size_t r = 0; r < 4; ++r)
                on_x[r] = mix(static_cast<double>(f[2 * r]), static_cast<double>(f[2 * r + 1]), u);
            lattice.at(x, y, z) = mix(mix(on_x[0], on_x[1], v), mix(on_x[2], on_x[3], v), w) >= 0 ? 1 : 0;
        });
        std::vector<std::uint32_t> sets(lattice.f.size());
        std::iota(sets.begin(), sets.end(), 0u);
        const auto number = [&](int x, int y, int z) {
            return static_cast<std::size_t>((z * kPoints + y) * kPoints + x);
        };
        Cube::for_each(kPoints, [&](int x, int y, int z) {
            for (int axis = 0; axis < 3; ++axis) {
                const std::array<int, 3> p{x + (axis == 0), y + (axis == 1), z + (axis == 2)};
                if (std::max({p[0], p[1], p[2]}) == kPoints) continue;
                if (lattice.at(p) == lattice.at(x, y, z))
                    internal::unite(sets, number(x, y, z), number(p[0], p[1], p[2]));
            }
        });
        bool same = true;
        for (unsigned a = 0; a < 8; ++a) {
            for (unsigned b = 0; b < a; ++b) {
                if ((f[a] >= 0) != (f[b] >= 0)) continue;
                const auto at = [&](unsigned v) {
                    constexpr int kEnd = kPoints - 1;
                    return internal::representative(
                        sets,
                        number((v & 1) != 0 ? kEnd : 0, (v & 2) != 0 ? kEnd : 0, (v & 4) != 0 ? kEnd : 0));
                };
                const bool on_lattice = at(a) == at(b),
                           in_cell = internal::representative(connected.sets, a) ==
                                     internal::representative(connected.sets, b);
                ASSERT_TRUE(in_cell || !on_lattice) << i;
                same &= in_cell == on_lattice;
            }
        }
        ++cells;
        agree += same ? 1 : 0;
    }
    EXPECT_GT(agree, 0.97 * cells);
    EXPECT_GT(tunnels, 3);
}

// The same values in all types that hold them have the same topology, and so do
// values beside another isovalue.
TEST(ExactTopologyOfShapes, DoesNotDependOnTheSampleType) {
    Random random(4);
    for (int i = 0; i < 300; ++i) {
        const Cube cube = random_cube(i % 2 == 0 ? Kind::signs : Kind::small, 4, random);
        const auto triangles = [&]<class T>(T, double offset, double factor) {
            const Volume volume = sampled<T>(grid(cube.n, cube.n, cube.n), [&](auto x, auto y, auto z) {
                return static_cast<double>(
                           cube.at(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z))) *
                           factor +
                       offset;
            });
            return extract_isosurface(volume, offset, kExact).triangles.size();
        };
        const auto expected = triangles(std::int32_t{}, 0, 1);
        ASSERT_EQ(triangles(std::uint8_t{}, 100, 1), expected) << i;
        ASSERT_EQ(triangles(std::int8_t{}, -100, 1), expected) << i;
        ASSERT_EQ(triangles(std::uint16_t{}, 65000, 7), expected) << i;
        ASSERT_EQ(triangles(std::int16_t{}, -3, 6000), expected) << i;
        ASSERT_EQ(triangles(float{}, 0, 0x1p-140), expected) << i;
        ASSERT_EQ(triangles(float{}, 0, 0x1p120), expected) << i;
        ASSERT_EQ(triangles(double{}, 0, 0x1p1020), expected) << i;
        ASSERT_EQ(triangles(double{}, 0, 0x1p-1060), expected) << i;
    }
}

// Extreme, equal and missing samples.
TEST_P(ExactTopology, IsAManifoldOfFinitePointsWhateverTheSamplesAre) {
    Random random(static_cast<std::uint64_t>(500 + GetParam()));
    for (int i = 0; i < 1000 * times_long(); ++i) {
        const RandomGrid g = random_grid(random);
        for (const bool closed : {false, true}) {
            const Mesh mesh =
                extract_isosurface(g.volume, g.isovalue, {.closed = closed, .topology = true, .threads = 1});
            ASSERT_EQ(manifold_fault(mesh, !closed), "") << "grid " << i;
            for (const auto* vectors : {&mesh.points, &mesh.normals}) {
                for (const Vec3f& v : *vectors)
                    ASSERT_TRUE(std::isfinite(v[0] + v[1] + v[2])) << "grid " << i;
            }
            std::set<PointBits> positions;
            for (const Vec3f& p : mesh.points)
                ASSERT_TRUE(positions.insert(bits_of(p)).second) << "grid " << i;
            const Mesh threaded =
                extract_isosurface(g.volume, g.isovalue, {.closed = closed, .topology = true, .threads = 3});
            ASSERT_EQ(mesh_hash(threaded), mesh_hash(mesh)) << "grid " << i;
        }
    }
}

// Faces are decided by the true samples. A tunnel that only scaled ones have would not fit between them.
TEST(ExactTopologyOfShapes, IsValidWhateverTheMagnitudesAre) {
    Random random(31);
    for (const double decades : {20, 33, 60, 150, 260, 300}) {
        for (int i = 0; i < 4; ++i) {
            const Volume volume = sampled<double>(grid(16, 16, 16), [&](auto, auto, auto) {
                const double sign = random() % 2 == 0 ? 1 : -1;
                return sign * std::pow(10, std::uniform_real_distribution(-decades, decades)(random));
            });
            const Mesh mesh = extract_isosurface(volume, 0, kExact);
            ASSERT_EQ(manifold_fault(mesh), "") << decades;
            ASSERT_EQ(check_mesh(mesh).self_intersections, 0) << decades;
        }
    }
    // Two opposite faces have determinants of different signs, so no contour across their axis is a cross.
    const CellValues cell{1.71674610e+123, -6.65060963e+121, -5.03183118e+286, 4.45901956e+237,
                          -9.84487434e-88, 4.38140676e+75,   3.93243457e+210,  -4.36760888e+189};
    unsigned inside = 0;
    for (unsigned v = 0; v < 8; ++v) inside |= (cell[v] >= 0 ? 1u : 0u) << v;
    EXPECT_FALSE(internal::decide_topology(inside, cell).has_tunnel());
}

TEST(ExactTopologyOfShapes, IsWithoutEffectWhereNothingIsAmbiguous) {
    const Volume volume = sampled_in_space<float>(grid(40, 40, 40), torus({20, 20, 20}, 11, 5));
    EXPECT_EQ(mesh_hash(extract_isosurface(volume, 0, {.topology = true})),
              mesh_hash(extract_isosurface(volume, 0)));
}

// Ties in which critical points easily coincide: if the values are moved by integers from -62 to 62 in units
// of 2^-26, 6 % of the draws are degenerate.
TEST(ExactTopologyOfShapes, IsTheSameHoweverTiesAreMovedApart) {
    constexpr std::array<int, 27> kInner{0,  -1, 0, 1,  -1, 1,  -1, -1, -1, 0, 1,  0, 0, -1,
                                         -1, 0,  0, -1, 0,  -1, -1, 0,  -1, 1, -1, 0, 0};
    Cube cube(5);
    Cube::for_each(5, [&](int x, int y, int z) {
        const int at = 9 * (z - 1) + 3 * (y - 1) + x - 1;
        cube.at(x, y, z) = cube.is_border(x, y, z) ? -5 : kInner[static_cast<std::size_t>(at)];
    });
    const MeshMeasures m = measure(cube.surface());
    Random random(5);
    for (int draw = 0; draw < 50; ++draw)
        ASSERT_EQ(m.euler_characteristic, 2 * chi_with_ties(cube, random)) << "draw " << draw;
}

// A wall one sample thick, askew in the grid, at less than half of its height.
TEST(ExactTopologyOfShapes, AWallAskewIsOnePiece) {
    const Volume wall = sampled<std::int16_t>(
        grid(20, 20, 20), [](auto x, auto y, auto z) { return x + y + z == 25 ? 1000 : 0; });
    const MeshMeasures plain = measure(extract_isosurface(wall, 400, {.closed = true}));
    EXPECT_GT(plain.components, 100);
    const MeshMeasures exact = measure(extract_isosurface(wall, 400, {.closed = true, .topology = true}));
    EXPECT_EQ(exact.components, 1);
}

// The tunnel is so narrow that the bands at its ends pass through each other. It is a ring all the same.
TEST(ExactTopologyOfShapes, ANarrowTunnelIsARing) {
    const std::array<std::int16_t, 8> samples{182, 65, 431, -693, -50, -3281, -20814, 23904};
    const Mesh mesh = extract_isosurface(VolumeView(samples.data(), grid(2, 2, 2)), 0.5, {.topology = true});
    EXPECT_EQ(manifold_fault(mesh, true), "");
    const MeshMeasures measures = measure(mesh);
    EXPECT_EQ(measures.components, 1);
    EXPECT_EQ(measures.euler_characteristic, 0);
}

TEST(ExactTopologyOfShapes, DoesNotGoWithSnap) {
    const Volume volume = checkerboard(4);
    EXPECT_THROW(extract_isosurface(volume, 0.5, {.snap = 0.3, .topology = true}), InputError);
}

}  // namespace
}  // namespace marrow::test
