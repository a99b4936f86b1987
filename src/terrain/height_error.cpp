// Rasterizes triangles and compares their heights with the samples.
#include "height_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace marrow::internal::terrain {

namespace {

// A sample on an edge may be inside both triangles or, by rounding, inside none. Each sample uses the
// triangle that it is deepest inside, and may be outside by this fraction of the triangle.
constexpr double kOutside = 1e-3;

double twice_area(const Vec3d& a, const Vec3d& b, double x, double y) {
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

// The surface's height at each sample of some rows, and how deep the sample is inside its triangle.
struct SurfaceHeights {
    SurfaceHeights(std::int64_t w, std::int64_t first, std::int64_t end)
        : width(w),
          first_row(first),
          end_row(end),
          heights(static_cast<std::size_t>(w * (end - first)), std::numeric_limits<double>::quiet_NaN()),
          depth(heights.size(), -kOutside) {}

    // Adds a triangle whose corners are in columns and rows.
    void add(std::span<const Vec3d, 3> p) {
        const double area = twice_area(p[0], p[1], p[2][0], p[2][1]);
        if (!(area > 0)) return;
        const auto range = [&](std::size_t axis, std::int64_t first, std::int64_t end) {
            const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
            return std::array<std::int64_t, 2>{
                std::max<std::int64_t>(static_cast<std::int64_t>(std::ceil(low - kOutside)), first),
                std::min<std::int64_t>(static_cast<std::int64_t>(std::floor(high + kOutside)), end - 1)};
        };
        const auto [x_begin, x_last] = range(0, 0, width);
        const auto [y_begin, y_last] = range(1, first_row, end_row);
        for (std::int64_t y = y_begin; y <= y_last; ++y) {
            for (std::int64_t x = x_begin; x <= x_last; ++x) {
                const double px = static_cast<double>(x), py = static_cast<double>(y);
                const double c = twice_area(p[0], p[1], px, py) / area;
                const double a = twice_area(p[1], p[2], px, py) / area;
                const double b = 1 - a - c;
                const auto at = static_cast<std::size_t>((y - first_row) * width + x);
                if (std::min({a, b, c}) <= depth[at]) continue;
                depth[at] = std::min({a, b, c});
                heights[at] = a * p[0][2] + b * p[1][2] + c * p[2][2];
            }
        }
    }

    std::int64_t width, first_row, end_row;
    std::vector<double> heights, depth;
};

}  // namespace

void HeightError::add_strip(double south, double north, std::vector<Vec3d> corners) {
    // The first row at or north of a northing.
    const auto row_at = [&](double northing) {
        const double row = std::ceil((northing - raster_.south()) / raster_.north_step() - 1e-9);
        return static_cast<std::int64_t>(std::clamp(row, 0.0, static_cast<double>(raster_.rows())));
    };
    for (Vec3d& corner : corners) {
        corner[0] = (corner[0] - raster_.west()) / raster_.east_step();
        corner[1] = (corner[1] - raster_.south()) / raster_.north_step();
    }
    // A strip of a much coarser surface has far more rows than fit into memory.
    constexpr std::int64_t kRows = 64;
    const std::int64_t end = row_at(north);
    for (std::int64_t first = row_at(south); first < end; first += kRows)
        add_rows(first, std::min(first + kRows, end), corners);
}

void HeightError::add_rows(std::int64_t first, std::int64_t end, std::span<const Vec3d> corners) {
    SurfaceHeights surface(raster_.columns(), first, end);
    std::vector<double> heights(surface.heights.size());
    raster_.read(first, end - first, heights.data());
    for (std::size_t t = 0; t < corners.size(); t += 3) surface.add(corners.subspan(t).first<3>());
    for (std::size_t at = 0; at < heights.size(); ++at) {
        const double error = std::abs(surface.heights[at] - heights[at]);
        if (std::isnan(error)) continue;  // no surface or no height
        squares_ += error * error;
        max_ = std::max(max_, error);
        ++samples_;
    }
}

double HeightError::rms() const {
    return samples_ > 0 ? std::sqrt(squares_ / static_cast<double>(samples_)) : 0;
}

}  // namespace marrow::internal::terrain
