/// Volumes for tests: random ones, named pathologies, and shapes with known surfaces.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <marrow/volume.h>

namespace marrow::test {

using Random = std::mt19937_64;

inline Geometry grid(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    Geometry g;
    g.dims = {nx, ny, nz};
    return g;
}

/// A volume with the sample value(x, y, z) at each index.
template <class T, class F>
Volume sampled(const Geometry& geometry, const F& value) {
    Volume volume(geometry, sample_type_of<T>());
    T* out = volume.samples<T>();
    for (std::int64_t z = 0; z < geometry.dims[2]; ++z) {
        for (std::int64_t y = 0; y < geometry.dims[1]; ++y) {
            for (std::int64_t x = 0; x < geometry.dims[0]; ++x) *out++ = static_cast<T>(value(x, y, z));
        }
    }
    return volume;
}

/// A volume whose samples are a function of their physical position.
template <class T, class F>
Volume sampled_in_space(const Geometry& geometry, const F& value) {
    return sampled<T>(geometry, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        return value(
            geometry.physical({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}));
    });
}

inline Volume checkerboard(std::int64_t n) {
    return sampled<std::uint8_t>(grid(n, n, n), [](auto x, auto y, auto z) { return (x + y + z) % 2; });
}

/// Equally many samples below, at and above the isovalue.
inline Volume ties_at_isovalue(const Geometry& g, double isovalue, Random& random) {
    std::uniform_int_distribution<int> step(-1, 1);
    return sampled<float>(g, [&](auto, auto, auto) { return isovalue + step(random); });
}

inline Volume one_voxel_thick_wall(std::int64_t n) {
    return sampled<std::int16_t>(grid(n, n, n), [&](auto x, auto, auto) { return x == n / 2 ? 1000 : 0; });
}

/// The distance to a sphere, positive inside, so that the sphere is the surface at isovalue 0.
inline auto sphere(const Vec3d& centre, double radius) {
    return [=](const Vec3d& p) {
        return radius - std::hypot(p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]);
    };
}

/// The same for a torus around an axis along z.
inline auto torus(const Vec3d& centre, double ring, double tube) {
    return [=](const Vec3d& p) {
        const double from_ring = std::hypot(p[0] - centre[0], p[1] - centre[1]) - ring;
        return tube - std::hypot(from_ring, p[2] - centre[2]);
    };
}

/// A random grid with difficult cells, 2 to 9 samples a side, and an isovalue for it.
struct RandomGrid {
    Volume volume;
    double isovalue;
};

inline RandomGrid random_grid(Random& random) {
    std::uniform_int_distribution<std::int64_t> side(2, 9);
    const Geometry g = grid(side(random), side(random), side(random));
    const int kind = std::uniform_int_distribution<int>(0, 9)(random);
    const auto pick = [&](auto... values) {
        const double choices[] = {static_cast<double>(values)...};
        return choices[random() % sizeof...(values)];
    };
    std::uniform_real_distribution<double> unit(-1, 1);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                     kInf = std::numeric_limits<double>::infinity();
    constexpr double kHuge = std::numeric_limits<float>::max(),
                     kTiny = std::numeric_limits<float>::denorm_min();
    switch (kind) {
        case 0:
            return {sampled<float>(g, [&](auto, auto, auto) { return unit(random); }), 0.1};
        case 1:
            return {sampled<std::uint8_t>(g, [&](auto, auto, auto) { return random() % 2; }), 0.5};
        case 2:
            return {ties_at_isovalue(g, 7, random), 7};
        case 3:
            return {sampled<std::int8_t>(g, [&](auto, auto, auto) { return pick(-128, -1, 0, 127); }), -0.5};
        case 4:
            return {sampled<float>(g, [&](auto, auto, auto) { return pick(0, 1, kNan, kInf, -kInf); }), 1};
        case 5:
            return {sampled<float>(g, [&](auto, auto, auto) { return pick(-kHuge, 0, kHuge); }), 1e38};
        case 6:
            return {sampled<float>(g, [&](auto, auto, auto) { return pick(-kTiny, 0, kTiny, 3 * kTiny); }),
                    kTiny};
        case 7:
            return {sampled<std::uint16_t>(g, [&](auto, auto, auto) { return random() % 65536; }), 40000};
        case 8:
            return {
                sampled<std::int32_t>(g, [&](auto, auto, auto) { return pick(INT32_MIN, -1, INT32_MAX); }),
                5};
        default:
            return {sampled<double>(g, [&](auto, auto, auto) { return pick(-1e308, unit(random), 1e308); }),
                    0};
    }
}

}  // namespace marrow::test
