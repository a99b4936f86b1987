#include "slice_frame.h"

#include <algorithm>
#include <cmath>

#include "samples.h"

namespace marrow::viewer {
namespace {

// Which index axis lies nearest to each patient axis, x y z of LPS, and which of them run against it.
struct PatientAxes {
    std::array<int, 3> index{0, 1, 2};
    std::array<bool, 3> against{false, false, false};
};

PatientAxes patient_axes(const Geometry& g) {
    std::array<int, 3> order{0, 1, 2};
    PatientAxes best;
    double best_sum = -1;
    do {
        double sum = 0;
        for (std::size_t p = 0; p < 3; ++p)
            sum += std::abs(g.direction[p][static_cast<std::size_t>(order[p])]);
        if (sum > best_sum + 1e-9) best_sum = sum, best.index = order;
    } while (std::next_permutation(order.begin(), order.end()));
    for (std::size_t p = 0; p < 3; ++p)
        best.against[p] = g.direction[p][static_cast<std::size_t>(best.index[p])] < 0;
    return best;
}

}  // namespace

SliceFrame slice_frame(const Geometry& geometry, Plane plane) {
    const PatientAxes axes = patient_axes(geometry);
    constexpr std::size_t kLeft = 0, kPosterior = 1, kSuperior = 2;
    const std::size_t across = plane == Plane::sagittal ? kPosterior : kLeft;
    const std::size_t down = plane == Plane::axial ? kPosterior : kSuperior;
    const std::size_t through = 3 - across - down;

    SliceFrame frame;
    frame.across = axes.index[across];
    frame.down = axes.index[down];
    frame.through = axes.index[through];
    frame.across_flipped = axes.against[across];
    frame.down_flipped = axes.against[down] != (down == kSuperior);  // superior is up
    const auto at = [](const auto& array, int axis) { return array[static_cast<std::size_t>(axis)]; };
    frame.size = {at(geometry.dims, frame.across), at(geometry.dims, frame.down)};
    frame.pixel = {at(geometry.spacing, frame.across), at(geometry.spacing, frame.down)};
    frame.left = plane == Plane::sagittal ? "A" : "R";
    frame.right = plane == Plane::sagittal ? "P" : "L";
    frame.top = plane == Plane::axial ? "A" : "S";
    frame.bottom = plane == Plane::axial ? "P" : "I";
    return frame;
}

QPointF SliceFrame::to_slice(const Vec3d& index) const {
    const double u = index[static_cast<std::size_t>(across)], v = index[static_cast<std::size_t>(down)];
    return {across_flipped ? static_cast<double>(size[0] - 1) - u : u,
            down_flipped ? static_cast<double>(size[1] - 1) - v : v};
}

Vec3d SliceFrame::to_index(const QPointF& place, const Vec3d& elsewhere) const {
    Vec3d index = elsewhere;
    index[static_cast<std::size_t>(across)] =
        across_flipped ? static_cast<double>(size[0] - 1) - place.x() : place.x();
    index[static_cast<std::size_t>(down)] =
        down_flipped ? static_cast<double>(size[1] - 1) - place.y() : place.y();
    return index;
}

std::vector<float> slice_samples(const Volume& volume, const SliceFrame& frame, std::int64_t through) {
    const auto& dims = volume.geometry().dims;
    const std::array<std::int64_t, 3> strides{1, dims[0], dims[0] * dims[1]};
    const auto stride = [&](int axis) { return strides[static_cast<std::size_t>(axis)]; };
    const auto [width, height] = frame.size;
    const std::int64_t step_across = frame.across_flipped ? -stride(frame.across) : stride(frame.across);
    const std::int64_t step_down = frame.down_flipped ? -stride(frame.down) : stride(frame.down);
    std::int64_t first = through * stride(frame.through);
    if (frame.across_flipped) first += (width - 1) * stride(frame.across);
    if (frame.down_flipped) first += (height - 1) * stride(frame.down);

    std::vector<float> result(static_cast<std::size_t>(width * height));
    with_samples(volume, [&, width = width, height = height](const auto* samples) {
        float* to = result.data();
        for (std::int64_t v = 0; v < height; ++v) {
            const auto* from = samples + first + v * step_down;
            for (std::int64_t u = 0; u < width; ++u, from += step_across) *to++ = static_cast<float>(*from);
        }
    });
    return result;
}

QVector<QLineF> slice_contour(const std::vector<float>& samples, std::array<std::int64_t, 2> size,
                              double isovalue) {
    const auto [width, height] = size;
    const auto inside = [&](float value) { return std::isfinite(value) && value >= isovalue; };
    // Where between a and b the isovalue lies; half-way where an end is not finite.
    const auto part = [&](float a, float b) {
        const double t = (isovalue - a) / (static_cast<double>(b) - a);
        return std::isfinite(t) ? std::clamp(t, 0.0, 1.0) : 0.5;
    };
    QVector<QLineF> lines;
    for (std::int64_t y = 0; y + 1 < height; ++y) {
        const float* row = samples.data() + y * width;
        for (std::int64_t x = 0; x + 1 < width; ++x) {
            // Corners round the face: a b
            //                         d c
            const float a = row[x], b = row[x + 1], d = row[x + width], c = row[x + width + 1];
            const int code = inside(a) | inside(b) << 1 | inside(c) << 2 | inside(d) << 3;
            if (code == 0 || code == 15) continue;
            const double left = static_cast<double>(x), top = static_cast<double>(y);
            const auto ab = [&] { return QPointF(left + part(a, b), top); };
            const auto bc = [&] { return QPointF(left + 1, top + part(b, c)); };
            const auto dc = [&] { return QPointF(left + part(d, c), top + 1); };
            const auto ad = [&] { return QPointF(left, top + part(a, d)); };
            switch (code) {
                case 1:
                case 14:
                    lines.append({ab(), ad()});
                    break;
                case 2:
                case 13:
                    lines.append({ab(), bc()});
                    break;
                case 4:
                case 11:
                    lines.append({bc(), dc()});
                    break;
                case 8:
                case 7:
                    lines.append({dc(), ad()});
                    break;
                case 3:
                case 12:
                    lines.append({ad(), bc()});
                    break;
                case 6:
                case 9:
                    lines.append({ab(), dc()});
                    break;
                case 5:  // a and c inside: apart
                    lines.append({ab(), ad()});
                    lines.append({bc(), dc()});
                    break;
                case 10:  // b and d inside: apart
                    lines.append({ab(), bc()});
                    lines.append({dc(), ad()});
                    break;
            }
        }
    }
    return lines;
}

}  // namespace marrow::viewer
