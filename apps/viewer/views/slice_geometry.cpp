#include "slice_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/samples.h"

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

SliceRange slice_range(const SliceFrame& frame, const SampleBox& box, std::int64_t through) {
    const auto outside = static_cast<std::size_t>(frame.through);
    if (through < box.first[outside] || through > box.last[outside]) return {};
    SliceRange range;
    const auto side = [&](std::size_t i, int axis, bool flipped) {
        const auto a = static_cast<std::size_t>(axis);
        const std::int64_t end = frame.size[i] - 1;
        range.first[i] = flipped ? end - box.last[a] : box.first[a];
        range.last[i] = flipped ? end - box.first[a] : box.last[a];
    };
    side(0, frame.across, frame.across_flipped);
    side(1, frame.down, frame.down_flipped);
    return range;
}

QVector<QLineF> slice_contour(const std::vector<float>& samples, std::array<std::int64_t, 2> size,
                              const SliceRange& range, double isovalue, bool closed) {
    QVector<QLineF> lines;
    if (range.empty()) return lines;
    // Rows of the range with a sample on either side; beyond the border is outside,
    // which is met half-way.
    constexpr float kBeyond = std::numeric_limits<float>::quiet_NaN();
    const std::int64_t width = range.last[0] - range.first[0] + 1;
    std::vector<float> above, below(static_cast<std::size_t>(width + 2), kBeyond);
    const auto read = [&](std::int64_t y) {
        above.swap(below);
        below.assign(static_cast<std::size_t>(width + 2), kBeyond);
        if (y < range.first[1] || y > range.last[1]) return;
        const float* from = samples.data() + y * size[0] + range.first[0];
        std::copy(from, from + width, below.begin() + 1);
    };
    const auto add = [&](const QPointF& from, const QPointF& to) { lines.append(QLineF(from, to)); };
    const auto inside = [&](float value) { return std::isfinite(value) && value >= isovalue; };
    // Where between a and b the isovalue lies; half-way where an end is not finite.
    const auto part = [&](float a, float b) {
        const double t = (isovalue - a) / (static_cast<double>(b) - a);
        return std::isfinite(t) ? std::clamp(t, 0.0, 1.0) : 0.5;
    };
    const std::int64_t pad = closed ? 1 : 0;
    read(range.first[1] - pad);
    for (std::int64_t y = range.first[1] - pad; y < range.last[1] + pad; ++y) {
        read(y + 1);
        for (std::int64_t x = 1 - pad; x < width + pad; ++x) {
            // Corners round the face: a b
            //                         d c
            const auto at = static_cast<std::size_t>(x);
            const float a = above[at], b = above[at + 1], d = below[at], c = below[at + 1];
            const int code = inside(a) | inside(b) << 1 | inside(c) << 2 | inside(d) << 3;
            if (code == 0 || code == 15) continue;
            const double left = static_cast<double>(range.first[0] + x - 1), top = static_cast<double>(y);
            const auto ab = [&] { return QPointF(left + part(a, b), top); };
            const auto bc = [&] { return QPointF(left + 1, top + part(b, c)); };
            const auto dc = [&] { return QPointF(left + part(d, c), top + 1); };
            const auto ad = [&] { return QPointF(left, top + part(a, d)); };
            switch (code) {
                case 1:
                case 14:
                    add(ab(), ad());
                    break;
                case 2:
                case 13:
                    add(ab(), bc());
                    break;
                case 4:
                case 11:
                    add(bc(), dc());
                    break;
                case 8:
                case 7:
                    add(dc(), ad());
                    break;
                case 3:
                case 12:
                    add(ad(), bc());
                    break;
                case 6:
                case 9:
                    add(ab(), dc());
                    break;
                case 5:  // a and c inside: apart
                    add(ab(), ad());
                    add(bc(), dc());
                    break;
                case 10:  // b and d inside: apart
                    add(ab(), bc());
                    add(dc(), ad());
                    break;
            }
        }
    }
    return lines;
}

QVector<QLineF> slice_mesh(const Mesh& mesh, const Geometry& geometry, const SampleBox& box,
                           const SliceFrame& frame, std::int64_t through) {
    const auto axis = static_cast<std::size_t>(frame.through);
    // How high above the slice a point is: the index along the axis is linear in the position.
    const Vec3d zero = index_of(geometry, {0, 0, 0});
    Vec3d slope;
    for (std::size_t a = 0; a < 3; ++a) {
        Vec3d one{};
        one[a] = 1;
        slope[a] = index_of(geometry, one)[axis] - zero[axis];
    }
    constexpr double kRounding = 1e-3;  // points of slices' own edges lie in the slice, but for float32
    std::vector<float> heights(mesh.points.size());
    for (std::size_t i = 0; i < heights.size(); ++i) {
        const Vec3f& p = mesh.points[i];
        const double height =
            slope[0] * p[0] + slope[1] * p[1] + slope[2] * p[2] + zero[axis] - static_cast<double>(through);
        heights[i] = std::abs(height) < kRounding ? 0 : static_cast<float>(height);
    }
    // Points in the slice count as being on its outer side, so that each edge in the slice is met once, by the triangle on
    // the inner side of it, also where an open mesh ends.
    const bool zero_is_above = 2 * through >= box.first[axis] + box.last[axis];
    const auto above = [&](std::uint32_t point) {
        return heights[point] > 0 || (heights[point] == 0 && zero_is_above);
    };
    QVector<QLineF> lines;
    for (const Triangle& t : mesh.triangles) {
        const int code = above(t[0]) | above(t[1]) << 1 | above(t[2]) << 2;
        if (code == 0 || code == 7) continue;
        // The corner that is alone on its side.
        const std::size_t alone = code == 1 || code == 6 ? 0 : code == 2 || code == 5 ? 1 : 2;
        if (heights[t[alone]] == 0) continue;  // which only touches the slice
        const auto crossing = [&](std::size_t other) {
            const Vec3f &a = mesh.points[t[alone]], &b = mesh.points[t[other]];
            const double ha = heights[t[alone]], hb = heights[t[other]], part = ha / (ha - hb);
            return frame.to_slice(index_of(
                geometry,
                {a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2])}));
        };
        lines.append(QLineF(crossing((alone + 1) % 3), crossing((alone + 2) % 3)));
    }
    return lines;
}

}  // namespace marrow::viewer
