// Generates phantoms and loads scans.
#include "volumes.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <marrow/error.h>
#include <marrow/scan_io.h>

#include "paper/cranium.h"

namespace marrow::bench {
namespace {

constexpr double kBone = 226;  // HU

// `slice(z)` returns a function of x and y that computes the samples of slice z.
template <class T, class F>
Volume sampled(std::int64_t n, const F& slice) {
    Geometry g;
    g.dims = {n, n, n};
    Volume volume(g, sample_type_of<T>());
    T* samples = volume.samples<T>();
    tbb::parallel_for(std::int64_t{0}, n, [&](std::int64_t z) {
        const auto value = slice(z);
        for (std::int64_t y = 0; y < n; ++y) {
            for (std::int64_t x = 0; x < n; ++x) samples[(z * n + y) * n + x] = static_cast<T>(value(x, y));
        }
    });
    return volume;
}

// Noise in [-1, 1] that depends only on the index.
double noise(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                      static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
                      static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9u;
    h = (h ^ (h >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>(static_cast<std::int64_t>(h >> 11)) / static_cast<double>(1LL << 52) - 1;
}

// The period is in samples.
template <class T>
Volume gyroid_samples(std::int64_t n, double period, double amplitude) {
    const double scale = 2 * 3.14159265358979 / period;
    return sampled<T>(n, [&](std::int64_t k) {
        const double z = scale * static_cast<double>(k), sin_z = std::sin(z), cos_z = std::cos(z);
        return [=](std::int64_t i, std::int64_t j) {
            const double x = scale * static_cast<double>(i), y = scale * static_cast<double>(j);
            return amplitude * (std::sin(x) * std::cos(y) + std::sin(y) * cos_z + sin_z * std::cos(x));
        };
    });
}

}  // namespace

Case head_phantom(std::int64_t n) {
    const auto unit = [n](std::int64_t i) {
        return (2 * static_cast<double>(i) - static_cast<double>(n) + 1) / static_cast<double>(n);
    };
    struct Tube {
        double x, y;
    };
    Volume volume = sampled<std::int16_t>(n, [&](std::int64_t k) {
        const double z = unit(k);
        std::array<Tube, 6> tubes;  // vessels and airways
        for (std::size_t t = 0; t < tubes.size(); ++t) {
            const double angle = 1.0471975512 * static_cast<double>(t);
            tubes[t] = {0.4 * std::cos(angle + z), 0.5 * std::sin(angle + z)};
        }
        return [=](std::int64_t i, std::int64_t j) {
            const double x = unit(i), y = unit(j);
            const auto ellipsoid = [&](double a, double b, double c) {
                return std::sqrt(x * x / (a * a) + y * y / (b * b) + z * z / (c * c));
            };
            double hu = -1000;
            if (ellipsoid(0.72, 0.88, 0.92) < 1) hu = 40;   // skin and muscle
            if (ellipsoid(0.66, 0.82, 0.86) < 1) hu = 900;  // skull
            if (ellipsoid(0.60, 0.76, 0.80) < 1) hu = 35 + 6 * std::sin(9 * x) * std::cos(8 * y);  // brain
            for (std::size_t t = 0; t < tubes.size(); ++t) {
                constexpr double radius = 0.03;
                const double dx = x - tubes[t].x, dy = y - tubes[t].y;
                if (std::abs(z) < 0.75 && std::abs(dx) < radius && std::hypot(dx, dy) < radius)
                    hu = t % 2 == 0 ? 350 : -900;
            }
            return hu + 12 * noise(i, j, k);
        };
    });
    return {"phantom-" + std::to_string(n), std::move(volume), kBone};
}

Case gyroid(std::int64_t n) {
    return {"gyroid-" + std::to_string(n), gyroid_samples<float>(n, 19, 1), 0.1};
}

Case waves(std::int64_t n, std::int64_t period) {
    return {"waves-" + std::to_string(n) + "-" + std::to_string(period),
            gyroid_samples<std::int16_t>(n, static_cast<double>(period), 1000), 100};
}

Case white_noise(std::int64_t n) {
    return {"noise-" + std::to_string(n),
            sampled<std::int16_t>(n,
                                  [](std::int64_t k) {
                                      return [=](std::int64_t i, std::int64_t j) {
                                          return 1000 * noise(i, j, k);
                                      };
                                  }),
            0.5};
}

std::optional<Case> named_volume(const std::string& name) {
    const auto dash = name.find('-');
    if (dash != std::string::npos) {
        const std::int64_t n = std::atoll(name.c_str() + dash + 1);
        if (n >= 2 && name.substr(0, dash) == "phantom") return head_phantom(n);
        if (n >= 2 && name.substr(0, dash) == "gyroid") return gyroid(n);
        if (n >= 2 && name.substr(0, dash) == "noise") return white_noise(n);
        const auto second = name.find('-', dash + 1);
        if (n >= 2 && second != std::string::npos && name.substr(0, dash) == "waves") {
            const std::int64_t period = std::atoll(name.c_str() + second + 1);
            if (period >= 4) return waves(n, period);
        }
    }
    if (name == "cranium") {
        std::optional<Volume> scan = cranium();
        if (!scan) return std::nullopt;
        return Case{name, std::move(*scan), kBone};
    }
    if (name == "vhf-head" || name == "vhf-ankle") {
        const char* data = std::getenv("MARROW_TEST_DATA");
        const auto folder =
            std::filesystem::path(data ? data : "") / (name == "vhf-head" ? "vhf_head_ct" : "vhf_ankle_ct");
        if (!data || !std::filesystem::exists(folder)) return std::nullopt;
        return Case{name, read_scan(folder), kBone};
    }
    throw InputError("unknown volume '" + name +
                     "'; use phantom-N, gyroid-N, waves-N-PERIOD, noise-N, cranium, vhf-head or vhf-ankle");
}

std::int64_t active_cells(const Case& c) {
    const auto count = [&](auto sample) {
        using T = decltype(sample);
        const T* samples = c.volume.samples<T>();
        const auto [nx, ny, nz] = c.volume.geometry().dims;
        std::atomic<std::int64_t> active = 0;
        tbb::parallel_for(std::int64_t{1}, nz, [&, nx = nx, ny = ny](std::int64_t z) {
            // For one row of cells: how many of the four samples at each x are inside.
            std::vector<unsigned char> inside(static_cast<std::size_t>(nx));
            std::int64_t found = 0;
            for (std::int64_t y = 1; y < ny; ++y) {
                const T* row = samples + ((z - 1) * ny + y - 1) * nx;
                const std::array<const T*, 4> rows{row, row + nx, row + nx * ny, row + nx * ny + nx};
                for (std::size_t x = 0; x < inside.size(); ++x) {
                    inside[x] = 0;
                    for (const T* r : rows) inside[x] += static_cast<double>(r[x]) >= c.isovalue;
                }
                for (std::size_t x = 1; x < inside.size(); ++x) {
                    const int corners = inside[x - 1] + inside[x];
                    found += corners != 0 && corners != 8;
                }
            }
            active += found;
        });
        return active.load();
    };
    return visit_sample_type(c.volume.type(), count);
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
