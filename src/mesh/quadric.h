/// The quadric error metric: weighted squared distances to planes and points.
#pragma once

#include <algorithm>
#include <optional>

#include <marrow/vector.h>

namespace marrow::internal {

/// The weighted sum of squared distances of a position x to planes and points: x.Ax - 2 b.x + c with
/// symmetric A. After Garland and Heckbert 1997.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  ///< A
    Vec3d b{};
    double c = 0;
    double weight = 0;

    /// Adds the plane through `p` with the unit normal `n`.
    void add_plane(const Vec3d& n, const Vec3d& p, double w) {
        const double d = dot(n, p);
        xx += w * n[0] * n[0];
        xy += w * n[0] * n[1];
        xz += w * n[0] * n[2];
        yy += w * n[1] * n[1];
        yz += w * n[1] * n[2];
        zz += w * n[2] * n[2];
        b = b + (w * d) * n;
        c += w * d * d;
        weight += w;
    }
    /// Adds a point, which determines the minimum if the planes do not. It does not count in `weight`.
    void add_point(const Vec3d& p, double w) {
        xx += w;
        yy += w;
        zz += w;
        b = b + w * p;
        c += w * dot(p, p);
    }
    Quadric& operator+=(const Quadric& q) {
        xx += q.xx;
        xy += q.xy;
        xz += q.xz;
        yy += q.yy;
        yz += q.yz;
        zz += q.zz;
        b = b + q.b;
        c += q.c;
        weight += q.weight;
        return *this;
    }

    Quadric& operator-=(const Quadric& q) {
        xx -= q.xx;
        xy -= q.xy;
        xz -= q.xz;
        yy -= q.yy;
        yz -= q.yz;
        zz -= q.zz;
        b = b - q.b;
        c -= q.c;
        weight -= q.weight;
        return *this;
    }

    /// The mean of the squared distances.
    double mean(const Vec3d& x) const {
        if (weight <= 0) return 0;
        const Vec3d ax{xx * x[0] + xy * x[1] + xz * x[2], xy * x[0] + yy * x[1] + yz * x[2],
                       xz * x[0] + yz * x[1] + zz * x[2]};
        return std::max(0.0, dot(x, ax) - 2 * dot(b, x) + c) / weight;
    }

    /// The position with the least sum, by Cramer's rule; nothing if A is nearly singular.
    std::optional<Vec3d> minimum() const {
        const Vec3d r0{xx, xy, xz}, r1{xy, yy, yz}, r2{xz, yz, zz};
        const Vec3d c12 = cross(r1, r2);
        const double determinant = dot(r0, c12);
        const double trace = xx + yy + zz;
        if (!(determinant > 1e-14 * trace * trace * trace)) return std::nullopt;
        const Vec3d c20 = cross(r2, r0), c01 = cross(r0, r1);
        return (1 / determinant) * (b[0] * c12 + b[1] * c20 + b[2] * c01);
    }
};

}  // namespace marrow::internal
