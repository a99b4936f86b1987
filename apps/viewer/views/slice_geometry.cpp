// Maps between slices and indices, reads slices, and traces contours.
#include "slice_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace marrow::viewer {
namespace {

// The index axis nearest to each patient axis (x, y, z of LPS), and whether it runs the other way.
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

// Stands for samples beyond the range. Since it is not finite, edges to it are crossed in the middle.
constexpr float kOutside = std::numeric_limits<float>::quiet_NaN();

// How far from a to b the isovalue is, as on the surface: never quite 0 or 1, and one half if an end is not
// finite.
double crossing(float a, float b, double isovalue) {
    constexpr double kLeast = 1.0 / 1024;
    if (!std::isfinite(a) || !std::isfinite(b)) return 0.5;
    return std::clamp((isovalue - a) / (static_cast<double>(b) - a), kLeast, 1 - kLeast);
}

// A square of four samples: a b
//                         d c
struct Face {
    double left, top;
    float a, b, c, d;
};

// Whether two inside corners at the ends of a diagonal are joined, by the asymptotic decider: whether the
// bilinear interpolant at its saddle is at least the isovalue. As on the surface, the decision is not
// rounded, ties join, and beside a sample that is not finite corners stay separated.
bool joins(float inside_a, float inside_b, float outside_a, float outside_b, double isovalue) {
    const double a = inside_a - isovalue, b = inside_b - isovalue, c = outside_a - isovalue,
                 d = outside_b - isovalue;
    const double inside = a * b, outside = c * d;
    if (!std::isfinite(outside)) return false;
    if (inside != outside) return inside > outside;
    return std::fma(a, b, -inside) >= std::fma(c, d, -outside);  // by what the products have lost
}

// Marching squares.
void add_face_lines(const Face& face, double isovalue, bool topology, QVector<QLineF>& lines) {
    const auto inside = [&](float value) { return std::isfinite(value) && value >= isovalue; };
    const auto [left, top, a, b, c, d] = face;
    const int code = inside(a) | inside(b) << 1 | inside(c) << 2 | inside(d) << 3;
    if (code == 0 || code == 15) return;
    const QPointF ab(left + crossing(a, b, isovalue), top), bc(left + 1, top + crossing(b, c, isovalue)),
        dc(left + crossing(d, c, isovalue), top + 1), ad(left, top + crossing(a, d, isovalue));
    const auto add = [&](const QPointF& from, const QPointF& to) { lines.append(QLineF(from, to)); };
    switch (code) {
        case 1:
        case 14:
            return add(ab, ad);
        case 2:
        case 13:
            return add(ab, bc);
        case 4:
        case 11:
            return add(bc, dc);
        case 7:
        case 8:
            return add(dc, ad);
        case 3:
        case 12:
            return add(ad, bc);
        case 6:
        case 9:
            return add(ab, dc);
        default: {  // 5 and 10: the corners alternate
            const bool joined =
                topology && (code == 5 ? joins(a, c, b, d, isovalue) : joins(b, d, a, c, isovalue));
            if ((code == 5) != joined) {
                add(ab, ad);
                return add(bc, dc);
            }
            add(ab, bc);
            return add(dc, ad);
        }
    }
}

// Draws a plane true to scale: maps multiples of the vectors `across` and `down`, mm, to the right and down.
// The angle between the two is kept. One of them stays level or upright.
QTransform true_to_scale(const Vec3d& across, const Vec3d& down, bool upright) {
    constexpr double kRounding = 1e-4;  // less than a tenth of a sample over a thousand samples
    const double wide = length(across), high = length(down);
    double cosine = dot(across, down) / (wide * high);
    if (std::abs(cosine) < kRounding) cosine = 0;
    const double sine = std::sqrt(1 - cosine * cosine);
    if (upright) return QTransform(wide * sine, wide * cosine, 0, high, 0, 0);
    return QTransform(wide, 0, high * cosine, high * sine, 0, 0);
}

// How far samples are apart in memory, and where the top left sample of slice 0 is.
struct Strides {
    std::int64_t first, across, down, through;
};

Strides strides_of(const Geometry& geometry, const SliceGeometry& slice) {
    const auto& dims = geometry.dims;
    const std::array<std::int64_t, 3> strides{1, dims[0], dims[0] * dims[1]};
    const auto along = [&](int axis, bool flipped) {
        return (flipped ? -1 : 1) * strides[static_cast<std::size_t>(axis)];
    };
    Strides result{0, along(slice.across, slice.across_flipped), along(slice.down, slice.down_flipped),
                   along(slice.through, false)};
    if (slice.across_flipped) result.first -= (slice.size[0] - 1) * result.across;
    if (slice.down_flipped) result.first -= (slice.size[1] - 1) * result.down;
    return result;
}

}  // namespace

SliceGeometry slice_geometry(const Geometry& geometry, Plane plane) {
    const PatientAxes axes = patient_axes(geometry);
    constexpr std::size_t kLeft = 0, kPosterior = 1, kSuperior = 2;
    const std::size_t across = plane == Plane::sagittal ? kPosterior : kLeft;
    const std::size_t down = plane == Plane::axial ? kPosterior : kSuperior;
    const std::size_t through = 3 - across - down;

    SliceGeometry slice;
    slice.across = axes.index[across];
    slice.down = axes.index[down];
    slice.through = axes.index[through];
    slice.across_flipped = axes.against[across];
    slice.down_flipped = axes.against[down] != (down == kSuperior);  // superior is up
    const auto at = [](const auto& array, int axis) { return array[static_cast<std::size_t>(axis)]; };
    slice.size = {at(geometry.dims, slice.across), at(geometry.dims, slice.down)};
    const auto column_of = [&](int axis, bool flipped) {
        const Vec3d along = column(geometry.index_to_physical(), static_cast<std::size_t>(axis));
        return flipped ? -1 * along : along;
    };
    const auto alignment = [&](std::size_t patient, int axis) {
        return std::abs(geometry.direction[patient][static_cast<std::size_t>(axis)]);
    };
    slice.to_mm = true_to_scale(column_of(slice.across, slice.across_flipped),
                                column_of(slice.down, slice.down_flipped),
                                alignment(down, slice.down) > alignment(across, slice.across));
    slice.left = plane == Plane::sagittal ? "A" : "R";
    slice.right = plane == Plane::sagittal ? "P" : "L";
    slice.top = plane == Plane::axial ? "A" : "S";
    slice.bottom = plane == Plane::axial ? "P" : "I";
    return slice;
}

QPointF SliceGeometry::to_slice(const Vec3d& index) const {
    const double u = index[static_cast<std::size_t>(across)], v = index[static_cast<std::size_t>(down)];
    return {across_flipped ? static_cast<double>(size[0] - 1) - u : u,
            down_flipped ? static_cast<double>(size[1] - 1) - v : v};
}

Vec3d SliceGeometry::to_index(const QPointF& point, const Vec3d& other) const {
    Vec3d index = other;
    index[static_cast<std::size_t>(across)] =
        across_flipped ? static_cast<double>(size[0] - 1) - point.x() : point.x();
    index[static_cast<std::size_t>(down)] =
        down_flipped ? static_cast<double>(size[1] - 1) - point.y() : point.y();
    return index;
}

std::vector<float> slice_samples(const Volume& volume, const SliceGeometry& slice, std::int64_t through) {
    const auto [width, height] = slice.size;
    const Strides strides = strides_of(volume.geometry(), slice);
    const Rescale rescale = volume.rescale();
    std::vector<float> result(static_cast<std::size_t>(width * height));
    visit_sample_type(volume.type(), [&, width = width, height = height](auto type) {
        const auto* samples = volume.samples<decltype(type)>();
        float* to = result.data();
        for (std::int64_t v = 0; v < height; ++v) {
            const auto* from = samples + strides.first + through * strides.through + v * strides.down;
            for (std::int64_t u = 0; u < width; ++u, from += strides.across)
                *to++ = static_cast<float>(rescale.value(static_cast<double>(*from)));
        }
    });
    return result;
}

double slice_isovalue(const Volume& volume, double isovalue) {
    const SampleType type = volume.type();
    const bool exact =
        volume.rescale().is_identity() && type != SampleType::int32 && type != SampleType::float64;
    return exact ? isovalue : static_cast<float>(isovalue);
}

std::int64_t slices_in(const Slab& slab, const Geometry& geometry, const SliceGeometry& slice) {
    const double spacing = geometry.spacing[static_cast<std::size_t>(slice.through)];
    return std::max<std::int64_t>(1, std::llround(slab.thickness / spacing));
}

std::vector<float> slab_samples(const Volume& volume, const SliceGeometry& slice, std::int64_t through,
                                const Slab& slab) {
    const Geometry& geometry = volume.geometry();
    const std::int64_t slices = slices_in(slab, geometry, slice);
    const std::int64_t end = geometry.dims[static_cast<std::size_t>(slice.through)];
    const std::int64_t lowest = std::max<std::int64_t>(through - (slices - 1) / 2, 0);
    const std::int64_t beyond = std::min(through - (slices - 1) / 2 + slices, end);
    const auto width = static_cast<std::size_t>(slice.size[0]);
    const Strides strides = strides_of(geometry, slice);
    const Rescale rescale = volume.rescale();
    const bool mean = slab.mode == Slab::Mode::mean;
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

    std::vector<float> result(width * static_cast<std::size_t>(slice.size[1]), kNothing);
    std::vector<double> sums(width);
    std::vector<std::int64_t> counts(width);
    visit_sample_type(volume.type(), [&](auto type) {
        const auto* samples = volume.samples<decltype(type)>() + strides.first;
        // Row by row, so that the samples of a row are read from the cache even if slices are interleaved.
        for (std::int64_t v = 0; v < slice.size[1]; ++v) {
            float* to = result.data() + static_cast<std::size_t>(v) * width;
            std::fill(sums.begin(), sums.end(), 0);
            std::fill(counts.begin(), counts.end(), 0);
            for (std::int64_t t = lowest; t < beyond; ++t) {
                const auto* from = samples + t * strides.through + v * strides.down;
                for (std::size_t u = 0; u < width; ++u, from += strides.across) {
                    const auto sample = static_cast<float>(rescale.value(static_cast<double>(*from)));
                    if (!std::isfinite(sample)) continue;
                    if (mean)
                        sums[u] += sample, ++counts[u];
                    else if (!(to[u] >= sample))
                        to[u] = sample;
                }
            }
            for (std::size_t u = 0; mean && u < width; ++u) {
                if (counts[u] > 0) to[u] = static_cast<float>(sums[u] / static_cast<double>(counts[u]));
            }
        }
    });
    return result;
}

SliceRange slice_range(const SliceGeometry& slice, const SampleBox& box, std::int64_t through) {
    const auto outside = static_cast<std::size_t>(slice.through);
    if (through < box.first[outside] || through > box.last[outside]) return {};
    SliceRange range;
    const auto side = [&](std::size_t i, int axis, bool flipped) {
        const auto a = static_cast<std::size_t>(axis);
        const std::int64_t end = slice.size[i] - 1;
        range.first[i] = flipped ? end - box.last[a] : box.first[a];
        range.last[i] = flipped ? end - box.first[a] : box.last[a];
    };
    side(0, slice.across, slice.across_flipped);
    side(1, slice.down, slice.down_flipped);
    return range;
}

QVector<QLineF> slice_contour(const std::vector<float>& samples, std::array<std::int64_t, 2> size,
                              const SliceRange& range, double isovalue, bool closed, bool topology) {
    QVector<QLineF> lines;
    if (range.empty()) return lines;
    // Two rows of the range, with a sample outside at either end.
    const auto width = static_cast<std::size_t>(range.last[0] - range.first[0] + 1);
    std::vector<float> upper, lower(width + 2, kOutside);
    const auto next_row = [&](std::int64_t y) {
        upper.swap(lower);
        lower.assign(width + 2, kOutside);
        if (y < range.first[1] || y > range.last[1]) return;
        const float* from = samples.data() + y * size[0] + range.first[0];
        std::copy(from, from + width, lower.begin() + 1);
    };
    const std::int64_t pad = closed ? 1 : 0;
    next_row(range.first[1] - pad);
    for (std::int64_t y = range.first[1] - pad; y < range.last[1] + pad; ++y) {
        next_row(y + 1);
        for (auto x = static_cast<std::size_t>(1 - pad); x < width + static_cast<std::size_t>(pad); ++x) {
            const double left = static_cast<double>(range.first[0] + static_cast<std::int64_t>(x) - 1);
            add_face_lines({left, static_cast<double>(y), upper[x], upper[x + 1], lower[x + 1], lower[x]},
                           isovalue, topology, lines);
        }
    }
    return lines;
}

QVector<QLineF> slice_mesh(const Mesh& mesh, const Geometry& geometry, const SampleBox& box,
                           const SliceGeometry& slice, std::int64_t through) {
    const auto axis = static_cast<std::size_t>(slice.through);
    // The height of a point above the slice: the index along the axis is a linear function of the position.
    const Vec3d zero = index_of(geometry, {0, 0, 0});
    Vec3d slope;
    for (std::size_t a = 0; a < 3; ++a) {
        Vec3d one{};
        one[a] = 1;
        slope[a] = index_of(geometry, one)[axis] - zero[axis];
    }
    constexpr double kRounding =
        1e-3;  // points on edges within the slice deviate from it by float32 rounding
    std::vector<float> heights(mesh.points.size());
    for (std::size_t i = 0; i < heights.size(); ++i) {
        const Vec3f& p = mesh.points[i];
        const double height =
            slope[0] * p[0] + slope[1] * p[1] + slope[2] * p[2] + zero[axis] - static_cast<double>(through);
        heights[i] = std::abs(height) < kRounding ? 0 : static_cast<float>(height);
    }
    // Points in the slice count as being on its outer side. Each edge in the slice is then found once, from
    // the triangle on its inner side, even at the border of an open mesh.
    const bool zero_is_above = 2 * through >= box.first[axis] + box.last[axis];
    const auto above = [&](std::uint32_t point) {
        return heights[point] > 0 || (heights[point] == 0 && zero_is_above);
    };
    QVector<QLineF> lines;
    for (const Triangle& t : mesh.triangles) {
        const int code = above(t[0]) | above(t[1]) << 1 | above(t[2]) << 2;
        if (code == 0 || code == 7) continue;
        // The only corner on its side of the slice.
        const std::size_t alone = code == 1 || code == 6 ? 0 : code == 2 || code == 5 ? 1 : 2;
        if (heights[t[alone]] == 0) continue;  // the triangle only touches the slice
        const auto crossing = [&](std::size_t other) {
            const Vec3f &a = mesh.points[t[alone]], &b = mesh.points[t[other]];
            const double ha = heights[t[alone]], hb = heights[t[other]], t = ha / (ha - hb);
            return slice.to_slice(index_of(
                geometry, {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])}));
        };
        lines.append(QLineF(crossing((alone + 1) % 3), crossing((alone + 2) % 3)));
    }
    return lines;
}

}  // namespace marrow::viewer
