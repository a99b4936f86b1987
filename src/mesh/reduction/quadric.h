/// The quadric error metric: weighted squared distances to planes.
#pragma once

#include <algorithm>

#include <marrow/vector.h>

namespace marrow::internal {

/// The weighted sum of squared distances to planes, of the position x relative to an origin: x.Ax - 2 b.x + c
/// with symmetric A. After Garland and Heckbert 1997. Near the planes, it loses no digits, so that floats can
/// store it.
template <class T>
struct Quadric {
    T xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  ///< A
    Vec3<T> b{};
    T c = 0;

    Quadric() = default;
    template <class U>
    explicit Quadric(const Quadric<U>& q)
        : xx(static_cast<T>(q.xx)),
          xy(static_cast<T>(q.xy)),
          xz(static_cast<T>(q.xz)),
          yy(static_cast<T>(q.yy)),
          yz(static_cast<T>(q.yz)),
          zz(static_cast<T>(q.zz)),
          b{static_cast<T>(q.b[0]), static_cast<T>(q.b[1]), static_cast<T>(q.b[2])},
          c(static_cast<T>(q.c)) {}

    /// Adds a plane through the origin with the unit normal `n`.
    void add_plane(const Vec3d& n, double weight) {
        xx += static_cast<T>(weight * n[0] * n[0]);
        xy += static_cast<T>(weight * n[0] * n[1]);
        xz += static_cast<T>(weight * n[0] * n[2]);
        yy += static_cast<T>(weight * n[1] * n[1]);
        yz += static_cast<T>(weight * n[1] * n[2]);
        zz += static_cast<T>(weight * n[2] * n[2]);
    }
    Quadric& operator+=(const Quadric& q) {
        xx += q.xx;
        xy += q.xy;
        xz += q.xz;
        yy += q.yy;
        yz += q.yz;
        zz += q.zz;
        for (std::size_t axis = 0; axis < 3; ++axis) b[axis] += q.b[axis];
        c += q.c;
        return *this;
    }

    Vec3<T> times(const Vec3<T>& x) const {
        return {xx * x[0] + xy * x[1] + xz * x[2], xy * x[0] + yy * x[1] + yz * x[2],
                xz * x[0] + yz * x[1] + zz * x[2]};
    }
    /// The sum at x.
    T operator()(const Vec3<T>& x) const { return std::max(T{0}, dot(x, times(x)) - 2 * dot(b, x) + c); }
    /// The same sum, relative to the origin x.
    Quadric relative_to(const Vec3<T>& x) const {
        Quadric result = *this;
        result.b = b - times(x);
        result.c = (*this)(x);
        return result;
    }
};

}  // namespace marrow::internal
