// Minimizes quadrics of several edges at a time. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/reduction/collapse_target.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "collapse_target.h"
#include "lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// The middle of an edge counts as a point with this fraction of the weight of its planes. Where the surface
// is flat or bends along the edge only, it determines the position, and short edges are collapsed first.
constexpr double kHold = 1e-4;

// As Quadric<double>, in each lane.
struct Quadrics {
    V xx, xy, xz, yy, yz, zz;
    Vectors<D> b;
    V c;

    HWY_INLINE Quadrics(const CollapseBatch::Ends& ends, std::size_t i)
        : xx(load(ends.xx + i)),
          xy(load(ends.xy + i)),
          xz(load(ends.xz + i)),
          yy(load(ends.yy + i)),
          yz(load(ends.yz + i)),
          zz(load(ends.zz + i)),
          b(load(ends.b, i)),
          c(load(ends.c + i)) {}

    HWY_INLINE Vectors<D> times(const Vectors<D>& v) const {
        return {dot({xx, xy, xz}, v), dot({xy, yy, yz}, v), dot({xz, yz, zz}, v)};
    }
    HWY_INLINE V at(const Vectors<D>& v) const {
        const D d;
        const V twice = hn::Mul(hn::Set(d, 2.0), dot(b, v));
        const V value = hn::Add(hn::Sub(dot(v, times(v)), twice), c);
        return hn::IfThenElseZero(hn::Gt(value, hn::Zero(d)), value);
    }
    HWY_INLINE V weight() const { return hn::Add(hn::Add(xx, yy), zz); }
    HWY_INLINE void move_origin_to(const Vectors<D>& v) {
        c = at(v);
        b = b - times(v);
    }
    HWY_INLINE void add(const Quadrics& q) {
        xx = hn::Add(xx, q.xx);
        xy = hn::Add(xy, q.xy);
        xz = hn::Add(xz, q.xz);
        yy = hn::Add(yy, q.yy);
        yz = hn::Add(yz, q.yz);
        zz = hn::Add(zz, q.zz);
        b = b + q.b;
        c = hn::Add(c, q.c);
    }
    HWY_INLINE void hold(const Vectors<D>& point, V w) {
        xx = hn::Add(xx, w);
        yy = hn::Add(yy, w);
        zz = hn::Add(zz, w);
        b = b + w * point;
    }
};

// The position with the least sum, by Cramer's rule, or `otherwise` where the matrix is nearly singular.
HWY_INLINE Vectors<D> minimum_or(const Quadrics& q, const Vectors<D>& otherwise) {
    const D d;
    const Vectors<D> r0{q.xx, q.xy, q.xz}, r1{q.xy, q.yy, q.yz}, r2{q.xz, q.yz, q.zz};
    const Vectors<D> c12 = cross(r1, r2), c20 = cross(r2, r0), c01 = cross(r0, r1);
    const V determinant = dot(r0, c12), trace = q.weight();
    const V least = hn::Mul(hn::Mul(hn::Mul(hn::Set(d, 1e-11), trace), trace), trace);
    const auto regular = hn::Gt(determinant, least);
    const Vectors<D> scaled = q.b.x * c12 + q.b.y * c20 + q.b.z * c01;
    const Vectors<D> found = hn::Div(hn::Set(d, 1.0), determinant) * scaled;
    return choose(regular, found, otherwise);
}

void find_targets(CollapseBatch& batch) {
    const D d;
    const hn::Rebind<float, D> df;
    for (std::size_t i = 0; i < batch.size(); i += hn::Lanes(d)) {
        const Vectors<D> a = load(batch.from_.position, i), b = load(batch.to_.position, i), along = b - a,
                         middle = hn::Set(d, 0.5) * along;
        const Quadrics of_a(batch.from_, i), of_b(batch.to_, i);
        Quadrics merged = of_b;
        merged.move_origin_to(a - b);
        merged.add(of_a);
        const V weight = merged.weight(), hold_weight = hn::Mul(hn::Set(d, kHold), weight),
                squared_length = dot(along, along);
        Quadrics held = merged;
        held.hold(middle, hold_weight);
        const Vectors<D> least = minimum_or(held, middle), off = least - middle;
        // If the minimum is far away, the planes are nearly parallel to a line, and rounding errors decide.
        const auto is_far = hn::Gt(dot(off, off), hn::Mul(hn::Set(d, 4.0), squared_length));
        const auto round = [&](V origin, V found, V otherwise, float* to) HWY_ATTR {
            const auto rounded = hn::DemoteTo(df, hn::Add(origin, hn::IfThenElse(is_far, otherwise, found)));
            hn::StoreU(rounded, df, to + i);
            return hn::Sub(hn::PromoteTo(d, rounded), origin);
        };
        const V sum = merged.at({round(a.x, least.x, middle.x, batch.position[0]),
                                 round(a.y, least.y, middle.y, batch.position[1]),
                                 round(a.z, least.z, middle.z, batch.position[2])});
        const V growth = hn::Sub(sum, hn::Add(of_a.c, of_b.c));
        const V cost = hn::Add(hn::IfThenElseZero(hn::Gt(growth, hn::Zero(d)), growth),
                               hn::Mul(hold_weight, squared_length));
        hn::StoreU(hn::DemoteTo(df, cost), df, batch.cost + i);
        hn::StoreU(sum, d, batch.sum + i);
        hn::StoreU(weight, d, batch.weight + i);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_targets);

void CollapseBatch::evaluate() {
    HWY_DYNAMIC_DISPATCH(find_targets)(*this);
}

}  // namespace marrow::internal
#endif
