#include "volumes.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <marrow/error.h>

namespace marrow::bench {

namespace {

template <class T, class F>
Volume sampled(std::int64_t n, const F& value) {
    Geometry g;
    g.dims = {n, n, n};
    Volume volume(g, sample_type_of<T>());
    T* samples = volume.samples<T>();
    tbb::parallel_for(std::int64_t{0}, n, [&](std::int64_t z) {
        for (std::int64_t y = 0; y < n; ++y) {
            for (std::int64_t x = 0; x < n; ++x)
                samples[(z * n + y) * n + x] = static_cast<T>(value(x, y, z));
        }
    });
    return volume;
}

// Noise that depends on the place alone, in [-1, 1].
double noise(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                      static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
                      static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9u;
    h = (h ^ (h >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>(static_cast<std::int64_t>(h >> 11)) / static_cast<double>(1LL << 52) - 1;
}

}  // namespace

Case head_phantom(std::int64_t n) {
    const auto unit = [n](std::int64_t i) {
        return (2 * static_cast<double>(i) - static_cast<double>(n) + 1) / static_cast<double>(n);
    };
    Volume volume = sampled<std::int16_t>(n, [&](std::int64_t i, std::int64_t j, std::int64_t k) {
        const double x = unit(i), y = unit(j), z = unit(k);
        const auto ellipsoid = [&](double a, double b, double c) {
            return std::sqrt(x * x / (a * a) + y * y / (b * b) + z * z / (c * c));
        };
        double hu = -1000;
        if (ellipsoid(0.72, 0.88, 0.92) < 1) hu = 40;   // skin and muscle
        if (ellipsoid(0.66, 0.82, 0.86) < 1) hu = 900;  // skull
        if (ellipsoid(0.60, 0.76, 0.80) < 1) hu = 35 + 6 * std::sin(9 * x) * std::cos(8 * y);  // brain
        for (int t = 0; t < 6; ++t) {  // vessels and airways
            const double angle = 1.0471975512 * t;
            const double dx = x - 0.4 * std::cos(angle + z), dy = y - 0.5 * std::sin(angle + z);
            if (std::abs(z) < 0.75 && std::hypot(dx, dy) < 0.03) hu = t % 2 == 0 ? 350 : -900;
        }
        return hu + 12 * noise(i, j, k);
    });
    return {"phantom-" + std::to_string(n), std::move(volume), 226};
}

Case gyroid(std::int64_t n) {
    const double scale = 2 * 3.14159265358979 / 19.0;
    Volume volume = sampled<float>(n, [&](std::int64_t i, std::int64_t j, std::int64_t k) {
        const double x = scale * static_cast<double>(i), y = scale * static_cast<double>(j),
                     z = scale * static_cast<double>(k);
        return std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
    });
    return {"gyroid-" + std::to_string(n), std::move(volume), 0.1};
}

Case raw_volume(const std::string& file, const std::array<std::int64_t, 3>& dims, const std::string& type,
                double isovalue) {
    Geometry g;
    g.dims = dims;
    for (const SampleType t : {SampleType::uint8, SampleType::int8, SampleType::uint16, SampleType::int16,
                               SampleType::int32, SampleType::float32, SampleType::float64}) {
        if (type != sample_type_name(t)) continue;
        Volume volume(g, t);
        std::ifstream in(file, std::ios::binary);
        if (!in.read(static_cast<char*>(volume.data()), static_cast<std::streamsize>(volume.bytes()))) {
            throw IoError(file + ": cannot read " + std::to_string(volume.bytes()) + " bytes");
        }
        return {std::filesystem::path(file).stem().string(), std::move(volume), isovalue};
    }
    throw InputError("unknown sample type '" + type +
                     "'; use uint8, int8, uint16, int16, int32, float32 or float64");
}

}  // namespace marrow::bench
