// Draws the middle slice of a scan.
#include "thumbnail.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "orientation.h"

namespace marrow::apps {
namespace {

// An index axis in the picture.
struct Side {
    std::size_t axis;
    bool reversed;
    std::int64_t samples;
    std::int64_t pixels;

    // The samples that make a pixel: from first(p) to first(p + 1), at least one.
    std::int64_t first(std::int64_t pixel) const { return pixel * samples / pixels; }
    std::int64_t sample(std::int64_t i) const { return reversed ? samples - 1 - i : i; }
};

struct Layout {
    Side across, down;
};

Layout layout_of(const Geometry& geometry, const Mat3d& direction, int pixels) {
    const std::size_t i = main_direction(direction, 0), j = main_direction(direction, 1);
    const std::size_t across = i > j ? 1 : 0, down = 1 - across;
    const auto size = [&](std::size_t axis) {
        return static_cast<double>(geometry.dims[axis]) * geometry.spacing[axis];
    };
    const double scale = pixels / std::max(size(0), size(1));
    const auto side = [&](std::size_t axis, bool reversed) {
        return Side{axis, reversed, geometry.dims[axis],
                    std::max<std::int64_t>(1, std::llround(scale * size(axis)))};
    };
    const bool axial = std::max(i, j) < 2;
    const auto increases = [&](std::size_t axis) { return direction[axis == 0 ? i : j][axis] > 0; };
    return {side(across, !increases(across)), side(down, increases(down) != axial)};
}

// The grey of a sample: 0 to 255.
struct Window {
    double lower, upper;

    double grey(double sample) const {
        if (!std::isfinite(sample)) return 0;
        return upper > lower ? 255 * std::clamp((sample - lower) / (upper - lower), 0.0, 1.0) : 0;
    }
};

template <class T>
Window window_of(const T* samples, std::int64_t count) {
    std::vector<T> finite;
    std::copy_if(samples, samples + count, std::back_inserter(finite),
                 [](T sample) { return std::isfinite(static_cast<double>(sample)); });
    if (finite.empty()) return {0, 0};
    const auto percentile = [&](double part) {
        const auto at =
            finite.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(finite.size() - 1));
        std::nth_element(finite.begin(), at, finite.end());
        return static_cast<double>(*at);
    };
    Window window{percentile(0.01), percentile(0.99)};
    if (window.lower == window.upper) window = {percentile(0), percentile(1)};
    return window;
}

// Draws a slice; each pixel is the mean of its samples.
template <class T>
Thumbnail draw(const T* slice, std::int64_t columns, std::int64_t rows, const Layout& layout) {
    const Window window = window_of(slice, columns * rows);
    const auto& [across, down] = layout;
    Thumbnail picture{static_cast<int>(across.pixels), static_cast<int>(down.pixels), {}};
    for (std::int64_t y = 0; y < down.pixels; ++y) {
        for (std::int64_t x = 0; x < across.pixels; ++x) {
            double sum = 0;
            std::int64_t count = 0;
            for (std::int64_t v = down.first(y); v < std::max(down.first(y) + 1, down.first(y + 1)); ++v) {
                for (std::int64_t u = across.first(x); u < std::max(across.first(x) + 1, across.first(x + 1));
                     ++u, ++count) {
                    const std::int64_t s = across.sample(u), t = down.sample(v);
                    sum += window.grey(
                        static_cast<double>(slice[across.axis == 0 ? t * columns + s : s * columns + t]));
                }
            }
            picture.grey.push_back(static_cast<std::uint8_t>(std::lround(sum / static_cast<double>(count))));
        }
    }
    return picture;
}

}  // namespace

Thumbnail draw_thumbnail(const Volume& scan, const Mat3d& direction, int pixels) {
    const Geometry& geometry = scan.geometry();
    const std::int64_t columns = geometry.dims[0], rows = geometry.dims[1];
    return visit_sample_type(scan.type(), [&](auto type) {
        return draw(scan.samples<decltype(type)>() + geometry.dims[2] / 2 * rows * columns, columns, rows,
                    layout_of(geometry, direction, pixels));
    });
}

}  // namespace marrow::apps
