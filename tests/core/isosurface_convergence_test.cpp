// With finer grids the surface approaches the exact shape at the rate of linear interpolation.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

constexpr double kPi = std::numbers::pi;

struct Shape {
    const char* name;
    std::function<double(const Vec3d&)> distance;  // positive inside
    double area, volume;
};

const Shape kShapes[] = {
    {"sphere", sphere({0.3, -0.2, 0.1}, 30), 4 * kPi * 900, 4 * kPi * 27000 / 3},
    {"torus", torus({0.1, 0.2, 0.3}, 25, 10), 4 * kPi* kPi * 250, 2 * kPi* kPi * 2500},
};

struct Sampling {
    const char* name;
    Vec3d stretch;  // relative spacing along the axes
    Mat3d direction;
};

const double kC = std::cos(0.5), kS = std::sin(0.5);
const Sampling kSamplings[] = {
    {"isotropic", {1, 1, 1}, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}},
    {"thick slices 1:1:5, turned", {1, 1, 5}, {{{kC, -kS, 0}, {kS, kC, 0}, {0, 0, 1}}}},
    {"mirrored", {1, 1, 1}, {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}},
};

// A grid around the origin, 80 mm wide in every direction, with n samples along the finest axis.
Geometry around_origin(const Sampling& sampling, int n) {
    Geometry g;
    g.direction = sampling.direction;
    Vec3d half;
    for (std::size_t a = 0; a < 3; ++a) {
        g.spacing[a] = 80.0 / n * sampling.stretch[a];
        g.dims[a] = static_cast<std::int64_t>(std::ceil(n / sampling.stretch[a])) + 1;
        half[a] = -0.5 * static_cast<double>(g.dims[a] - 1);
    }
    g.origin = g.physical(half);
    return g;
}

struct Errors {
    double distance, area, volume, face_normal;
};

Errors errors(const Shape& shape, const Geometry& g) {
    const Volume volume = sampled_in_space<double>(g, shape.distance);
    const Mesh mesh = extract_isosurface(volume, 0);
    const MeshMeasures m = measure(mesh);
    EXPECT_EQ(m.boundary_edges, 0) << shape.name;
    EXPECT_GT(m.volume, 0) << shape.name << ": faces inwards";
    Errors e{0, std::abs(m.area - shape.area), std::abs(m.volume - shape.volume), 0};
    double weight = 0;
    for (const Triangle& t : mesh.triangles) {
        Vec3d p[3], centre{};
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t a = 0; a < 3; ++a) {
                p[c][a] = static_cast<double>(mesh.points[t[c]][a]);
                centre[a] += p[c][a] / 3;
            }
        }
        // Weighted by area, because the normals of slivers are arbitrary.
        Vec3d u, v;
        for (std::size_t a = 0; a < 3; ++a) u[a] = p[1][a] - p[0][a], v[a] = p[2][a] - p[0][a];
        const Vec3d normal{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        const double area = std::hypot(normal[0], normal[1], normal[2]);
        Vec3d outward;
        for (std::size_t a = 0; a < 3; ++a) {
            Vec3d ahead = centre, behind = centre;
            ahead[a] += 1e-4;
            behind[a] -= 1e-4;
            outward[a] = (shape.distance(behind) - shape.distance(ahead)) / 2e-4;
        }
        e.distance = std::max(e.distance, std::abs(shape.distance(centre)));
        double off = 0;
        for (std::size_t a = 0; a < 3; ++a) off += std::pow(normal[a] - area * outward[a], 2);
        e.face_normal += std::sqrt(off);
        weight += area;
    }
    e.face_normal /= weight;
    for (std::size_t i = 0; i < mesh.normals.size(); i += 97) {
        const Vec3f& p = mesh.points[i];
        Vec3d ahead, behind;
        for (std::size_t a = 0; a < 3; ++a) {
            ahead[a] = static_cast<double>(p[a]) + 0.01 * static_cast<double>(mesh.normals[i][a]);
            behind[a] = static_cast<double>(p[a]) - 0.01 * static_cast<double>(mesh.normals[i][a]);
        }
        EXPECT_LT(shape.distance(ahead), shape.distance(behind)) << "a normal points inwards";
    }
    return e;
}

TEST(Convergence, OrderOfDistanceAreaVolumeAndNormals) {
    for (const Shape& shape : kShapes) {
        for (const Sampling& sampling : kSamplings) {
            SCOPED_TRACE(std::string(shape.name) + ", " + sampling.name);
            // Starts with a spacing that resolves the shape in every direction.
            const bool thick = sampling.stretch[2] > 1;
            const int coarse_n = thick ? 64 : 32, steps = thick ? 2 : 3;
            const Errors coarse = errors(shape, around_origin(sampling, coarse_n));
            const Errors fine = errors(shape, around_origin(sampling, coarse_n << steps));
            const auto order = [&](double c, double f) { return std::log2(c / f) / steps; };
            EXPECT_GE(order(coarse.distance, fine.distance), 1.9);
            EXPECT_GE(order(coarse.area, fine.area), 1.9);
            EXPECT_GE(order(coarse.volume, fine.volume), 1.9);
            EXPECT_GE(order(coarse.face_normal, fine.face_normal), 0.9);
        }
    }
}

TEST(Convergence, DarkObjectsFaceInwardsIntoTheirBrightSurrounding) {
    const Volume bright = sampled_in_space<float>(grid(40, 40, 40), sphere({20, 20, 20}, 12));
    const Volume dark = sampled_in_space<float>(grid(40, 40, 40), [](const Vec3d& p) {
        return -sphere({20, 20, 20}, 12)(p);
    });
    EXPECT_NEAR(measure(extract_isosurface(bright, 0)).volume, 4 * kPi * 1728 / 3, 60);
    EXPECT_NEAR(measure(extract_isosurface(dark, 0)).volume, -4 * kPi * 1728 / 3, 60);
}

}  // namespace
}  // namespace marrow::test
