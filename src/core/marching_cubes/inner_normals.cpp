// Computes normals with a point in each lane of vectors.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/inner_normals.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "inner_normals.h"

#include "cell_topology.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Points = hn::CappedTag<double, 8>;
using PointVec = hn::Vec<Points>;

// Vectors in space, of a point in each lane.
struct PointVectors {
    PointVec values[3];
};

HWY_INLINE PointVec dot(const PointVectors& a, const PointVectors& b) {
    return hn::Add(hn::Add(hn::Mul(a.values[0], b.values[0]), hn::Mul(a.values[1], b.values[1])),
                   hn::Mul(a.values[2], b.values[2]));
}

HWY_INLINE PointVec constant(double value) {
    return hn::Set(Points(), value);
}

// Between the gradients at the corners.
HWY_INLINE PointVectors between_corners(const std::array<Vec3d, 8>& corners, const PointVectors& at) {
    const Points d;
    PointVectors gradient{{hn::Zero(d), hn::Zero(d), hn::Zero(d)}};
    for (std::size_t v = 0; v < 8; ++v) {
        auto weight = constant(1);
        for (std::size_t a = 0; a < 3; ++a)
            weight = hn::Mul(weight, (v >> a & 1) != 0 ? at.values[a] : hn::Sub(constant(1), at.values[a]));
        for (std::size_t a = 0; a < 3; ++a)
            gradient.values[a] = hn::Add(gradient.values[a], hn::Mul(weight, constant(corners[v][a])));
    }
    return gradient;
}

// That of the interpolant, with the operations of Interpolant.
HWY_INLINE PointVectors of_interpolant(const CellValues& f, const PointVectors& at) {
    const auto mix = [](PointVec a, PointVec b, PointVec t)
                         HWY_ATTR { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); };
    const auto along_x = [&](std::size_t v)
                             HWY_ATTR { return mix(constant(f[v]), constant(f[v + 1]), at.values[0]); };
    const auto rise = [&](std::size_t v) HWY_ATTR { return constant(f[v + 1] - f[v]); };
    const PointVec y = at.values[1], z = at.values[2];
    const PointVec f00 = along_x(0), f10 = along_x(2), f01 = along_x(4), f11 = along_x(6);
    return {{mix(mix(rise(0), rise(2), y), mix(rise(4), rise(6), y), z),
             mix(hn::Sub(f10, f00), hn::Sub(f11, f01), z), hn::Sub(mix(f01, f11, y), mix(f00, f10, y))}};
}

// The gradients as directions in space.
HWY_INLINE PointVectors normals_of(const IndexToPhysical& to_physical, const PointVectors& gradient) {
    const Points d;
    auto steepest = hn::Zero(d);
    for (const PointVec g : gradient.values) {
        const auto magnitude = hn::Abs(g);
        steepest = hn::IfThenElse(hn::Lt(steepest, magnitude), magnitude, steepest);
    }
    const auto scale = hn::Div(constant(1), steepest);
    PointVectors scaled, normal;
    for (std::size_t a = 0; a < 3; ++a) scaled.values[a] = hn::Mul(scale, gradient.values[a]);
    for (std::size_t r = 0; r < 3; ++r) {
        const Vec3d row = to_double(to_physical.normal_matrix[r]);
        normal.values[r] = dot({{constant(row[0]), constant(row[1]), constant(row[2])}}, scaled);
    }
    const auto per_length = hn::Div(constant(1), hn::Sqrt(dot(normal, normal)));
    // Where there is no gradient, the normal is along x.
    const auto defined = hn::Le(hn::Abs(per_length), constant(std::numeric_limits<double>::max()));
    for (std::size_t r = 0; r < 3; ++r) {
        normal.values[r] =
            hn::IfThenElse(defined, hn::Mul(per_length, normal.values[r]), constant(to_physical.axis[0][r]));
    }
    return normal;
}

void inner_normals_target(const CellSlopes& cell, const Vec3d* points, std::size_t count,
                          const IndexToPhysical& to_physical, Vec3f* normals) {
    const Points d;
    constexpr std::size_t kMostPoints = 8;  // whole vectors
    static_assert(CellTopology::kTunnelPoints <= kMostPoints && kMostPoints % hn::MaxLanes(Points()) == 0);
    HWY_ALIGN double lanes[3][kMostPoints] = {};
    for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t a = 0; a < 3; ++a) lanes[a][k] = points[k][a];
    }
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        const PointVectors at{
            {hn::Load(d, lanes[0] + i), hn::Load(d, lanes[1] + i), hn::Load(d, lanes[2] + i)}};
        PointVectors gradient = of_interpolant(cell.values, at);
        if (HWY_LIKELY(cell.has_corners)) {
            const PointVectors smooth = between_corners(cell.corners, at);
            const auto same_side = hn::Gt(dot(smooth, gradient), hn::Zero(d));
            for (std::size_t a = 0; a < 3; ++a)
                gradient.values[a] = hn::IfThenElse(same_side, smooth.values[a], gradient.values[a]);
        }
        const PointVectors normal = normals_of(to_physical, gradient);
        for (std::size_t a = 0; a < 3; ++a) hn::Store(normal.values[a], d, lanes[a] + i);
    }
    for (std::size_t k = 0; k < count; ++k) normals[k] = to_float({lanes[0][k], lanes[1][k], lanes[2][k]});
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(inner_normals_target);

void inner_normals(const CellSlopes& cell, const Vec3d* points, std::size_t count,
                   const IndexToPhysical& to_physical, Vec3f* normals) {
    HWY_DYNAMIC_DISPATCH(inner_normals_target)(cell, points, count, to_physical, normals);
}

}  // namespace marrow::internal
#endif
