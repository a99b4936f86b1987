/// What the tests of marrow::gpu share. They run on whichever device comes first.
#pragma once

#include <gtest/gtest.h>

#include <marrow/gpu.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <memory>

#include "gpu/vulkan_device.h"
#include "support/fields.h"

namespace marrow::test {

template <class T>
bool same_bytes(const Buffer<T>& a, const Buffer<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline void expect_same_bytes(const Mesh& mesh, const Mesh& expected) {
    EXPECT_TRUE(same_bytes(mesh.points, expected.points))
        << mesh.points.size() << " points, and " << expected.points.size() << " on the CPU";
    EXPECT_TRUE(same_bytes(mesh.normals, expected.normals));
    EXPECT_TRUE(same_bytes(mesh.triangles, expected.triangles));
}

/// Extracts on both. Fails unless the bytes are the same; returns the number of points.
inline std::size_t compare(gpu::Extractor& extractor, const VolumeView& volume, double isovalue,
                           const IsosurfaceOptions& options) {
    IsosurfaceStats expected_stats, stats;
    const Mesh expected = extract_isosurface(volume, isovalue, options, &expected_stats);
    const Mesh& mesh = extractor.extract(isovalue, &stats);
    expect_same_bytes(mesh, expected);
    EXPECT_EQ(stats.non_finite_samples, expected_stats.non_finite_samples);
    return mesh.points.size();
}

/// The same at several isovalues, open and closed.
inline std::size_t compare(const VolumeView& volume, std::initializer_list<double> isovalues) {
    std::size_t points = 0;
    for (const bool closed : {false, true}) {
        const IsosurfaceOptions options{.closed = closed};
        gpu::Extractor extractor(volume, options);
        for (const double isovalue : isovalues) {
            SCOPED_TRACE(testing::Message() << sample_type_name(volume.type) << " at " << isovalue
                                            << (closed ? ", closed" : ", open"));
            points += compare(extractor, volume, isovalue, options);
        }
    }
    return points;
}

inline std::size_t compare(const Volume& volume, std::initializer_list<double> isovalues) {
    return compare(VolumeView(volume), isovalues);
}

/// Smooth samples with noise.
template <class T>
Volume scan(const Geometry& g, Random& random) {
    std::normal_distribution<double> noise(0, 4);
    const auto [nx, ny, nz] = g.dims;
    return sampled<T>(g, [&, nx = nx, ny = ny, nz = nz](auto x, auto y, auto z) {
        const double r = std::hypot(static_cast<double>(2 * x - nx) / static_cast<double>(nx),
                                    static_cast<double>(2 * y - ny) / static_cast<double>(ny),
                                    static_cast<double>(2 * z - nz) / static_cast<double>(nz));
        return std::clamp(120 - 90 * r + noise(random), 0.0, 127.0);
    });
}

inline Geometry oblique(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    Geometry g = grid(nx, ny, nz);
    g.spacing = {0.7, 1.1, 2.3};
    g.origin = {-113.7, 41.3, 1207.9};
    const double c = std::cos(0.3), s = std::sin(0.3);
    g.direction = {{{c, -s, 0.1}, {s, c, 0}, {0, 0, std::sqrt(1 - 0.01)}}};  // the gantry is tilted
    return g;
}

/// The first device as if it could do less, while this lives.
class SmallDevice {
  public:
    /// `change` changes the device's limits.
    template <class F>
    explicit SmallDevice(const F& change)
        : device_(gpu::internal::open_device(0)), before_(device_->limits()) {
        gpu::internal::Limits limits = before_;
        change(limits);
        device_->set_limits(limits);
    }
    ~SmallDevice() { device_->set_limits(before_); }

  private:
    std::shared_ptr<gpu::internal::VulkanDevice> device_;
    gpu::internal::Limits before_;
};

}  // namespace marrow::test
