// The triangles of tunnels do not pass through each other.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>

#include <marrow/isosurface.h>
#include <marrow/mesh_check.h>

#include "core/marching_cubes/cell_topology.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

const IsosurfaceOptions kExact{.closed = true, .topology = true};

// A grid in which rounding moves points off the planes that they share. Each number has another place.
Geometry askew(std::int64_t side, int number = 0) {
    Geometry g = grid(side, side, side);
    g.spacing = {0.45, 0.7, 1.3};
    g.origin = {-113.4 + 7.3 * number, 87.9 + 3.1 * number, -1203.3 + 11.7 * number};
    g.direction = {{{0.8, -0.6, 0}, {0.6, 0.8, 0}, {0, 0, 1}}};
    return g;
}

struct Noise {
    std::string name;
    std::function<double(Random&)> sample;
    double isovalue;
};

void PrintTo(const Noise& noise, std::ostream* out) {
    *out << noise.name;
}

class Tunnels : public testing::TestWithParam<Noise> {};

// The narrower the range of the samples, the more often a slice with a cross is in or near a face of the
// cell, and there the shortest bands cross.
INSTANTIATE_TEST_SUITE_P(
    Noises, Tunnels,
    testing::Values(
        Noise{"Narrow", [](Random& r) { return std::round(std::normal_distribution(0.0, 5.0)(r)); }, 0.5},
        Noise{"NarrowWithTies", [](Random& r) { return std::round(std::normal_distribution(0.0, 5.0)(r)); },
              0},
        Noise{"Wide", [](Random& r) { return std::round(std::normal_distribution(0.0, 1000.0)(r)); }, 0.5},
        Noise{"OfAllMagnitudes",
              [](Random& r) {
                  const double size = std::exp2(std::uniform_real_distribution(0.0, 15.0)(r));
                  return r() % 2 == 0 ? std::floor(size) : -std::floor(size);
              },
              0.5}),
    [](const auto& noise) { return noise.param.name; });

TEST_P(Tunnels, DoNotPassThroughThemselves) {
    constexpr std::int64_t kSide = 64;
    Random random(1);
    const Volume volume =
        sampled<std::int16_t>(askew(kSide), [&](auto, auto, auto) { return GetParam().sample(random); });
    const Mesh mesh = extract_isosurface(volume, GetParam().isovalue, kExact);
    EXPECT_EQ(manifold_fault(mesh), "");
    EXPECT_EQ(check_mesh(mesh).self_intersections, 0);
}

// Cells whose shortest bands cross or touch. In some of them, so do all pairs of bands that are the shortest
// from where they begin on the ring.
class CellsWithTunnels : public testing::TestWithParam<std::array<double, 8>> {};

INSTANTIATE_TEST_SUITE_P(
    Cells, CellsWithTunnels,
    testing::Values(std::array<double, 8>{181.5, 64.5, 430.5, -693.5, -50.5, -3281.5, -20814.5, 23903.5},
                    std::array<double, 8>{0.5, -0.5, -4.5, 4.5, -4.5, 4.5, 3.5, -6.5},
                    std::array<double, 8>{-3.5, 3.5, 0.5, -0.5, -2.5, -3.5, -5.5, 5.5},
                    std::array<double, 8>{-22290.5, 8645.5, -67.5, 337.5, -16.5, 132.5, 7.5, -37.5},
                    std::array<double, 8>{-15428.5, 4.5, 4638.5, -13.5, 1949.5, -0.5, -3945.5, 1.5}));

TEST_P(CellsWithTunnels, DoNotPassThroughThemselves) {
    const internal::CellValues& f = GetParam();
    unsigned inside = 0;
    for (std::size_t v = 0; v < 8; ++v) inside |= (f[v] >= 0 ? 1u : 0u) << v;
    ASSERT_TRUE(internal::decide_topology(inside, f).has_tunnel());
    for (int place = 0; place < 50; ++place) {
        const Volume volume = sampled<float>(askew(2, place), [&](auto x, auto y, auto z) {
            return f[static_cast<std::size_t>(x + 2 * y + 4 * z)];
        });
        const Mesh mesh = extract_isosurface(volume, 0, kExact);
        EXPECT_EQ(manifold_fault(mesh), "");
        EXPECT_EQ(check_mesh(mesh).self_intersections, 0) << place;
    }
}

}  // namespace
}  // namespace marrow::test
