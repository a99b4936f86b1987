// Compares products with vectors, a cell in each lane.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/face_signs.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/grid/cell.h"
#include "face_signs.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using DoubleVec = hn::Vec<Doubles>;
using LaneMask = hn::Mask<Doubles>;

struct Signs {
    LaneMask positive, negative;
};

// More than the rounding error of a polynomial per magnitude of its terms, as fewer than 16 roundings follow
// each other, and than that of a product which is nearly too small for doubles.
constexpr double kRounding = 16 * 0x1p-53, kLeast = 0x1p-1000;

// The products of the two diagonals of a face, whose difference is its determinant.
struct Determinant {
    DoubleVec first, second;

    HWY_INLINE Determinant(const DoubleVec (&f)[8], const std::uint8_t (&ring)[4])
        : first(hn::Mul(f[ring[0]], f[ring[2]])), second(hn::Mul(f[ring[1]], f[ring[3]])) {}

    // Rounding is monotonic, so rounded products are never in the wrong order. Neither is true for NaN.
    HWY_INLINE Signs signs() const { return {hn::Gt(first, second), hn::Lt(first, second)}; }
    HWY_INLINE DoubleVec value() const { return hn::Sub(first, second); }
    HWY_INLINE DoubleVec magnitude() const { return hn::Add(hn::Abs(first), hn::Abs(second)); }
};

// The mixed determinant of the faces across an axis, whose first corners are 0 and `across`, and the sum of
// the magnitudes of its terms.
struct MixedDeterminant {
    DoubleVec value, magnitude;

    HWY_INLINE MixedDeterminant(const DoubleVec (&f)[8], unsigned across, unsigned u, unsigned v) {
        const auto a = hn::Mul(f[0], f[across | u | v]), b = hn::Mul(f[u | v], f[across]);
        const auto c = hn::Mul(f[v], f[across | u]), e = hn::Mul(f[u], f[across | v]);
        value = hn::Sub(hn::Add(a, b), hn::Add(c, e));
        magnitude = hn::Add(hn::Add(hn::Abs(a), hn::Abs(b)), hn::Add(hn::Abs(c), hn::Abs(e)));
    }

    HWY_INLINE Signs signs() const {
        const Doubles d;
        const auto doubt = hn::Add(hn::Mul(magnitude, hn::Set(d, kRounding)), hn::Set(d, kLeast));
        return {hn::Gt(value, doubt), hn::Lt(value, hn::Neg(doubt))};
    }
};

// Where the hyperdeterminant is surely negative.
HWY_INLINE LaneMask without_crosses(const Determinant& near, const Determinant& far,
                                    const MixedDeterminant& mixed) {
    const Doubles d;
    const auto four = hn::Set(d, 4.0);
    const auto square = hn::Mul(mixed.value, mixed.value);
    const auto product = hn::Mul(four, hn::Mul(near.value(), far.value()));
    const auto magnitude = hn::Add(hn::Mul(mixed.magnitude, mixed.magnitude),
                                   hn::Mul(four, hn::Mul(near.magnitude(), far.magnitude())));
    // An error of a small product is multiplied by the other factor.
    const auto factors = hn::Add(hn::Add(near.magnitude(), far.magnitude()), mixed.magnitude);
    const auto doubt = hn::Add(hn::Mul(magnitude, hn::Set(d, kRounding)),
                               hn::Mul(hn::Add(factors, hn::Set(d, 1.0)), hn::Set(d, kLeast)));
    return hn::Lt(hn::Add(square, doubt), product);
}

void find_signs_target(const CellBatch& batch, std::size_t count, FaceSigns* signs) {
    const Doubles d;
    const hn::RebindToUnsigned<Doubles> du;
    static_assert(sizeof(FaceSigns) == sizeof(std::uint64_t));
    static_assert(CellBatch::kCells % hn::MaxLanes(Doubles()) == 0);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        DoubleVec f[8];
        for (std::size_t v = 0; v < 8; ++v) f[v] = hn::Load(d, batch.corners[v] + i);
        auto bits = hn::Zero(du);
        const auto set = [&](LaneMask which, unsigned bit) HWY_ATTR {
            const auto one = hn::Set(du, std::uint64_t{1} << bit);
            bits = hn::Or(bits, hn::IfThenElseZero(hn::RebindMask(du, which), one));
        };
        for (unsigned axis = 0; axis < 3; ++axis) {
            const Determinant near_face(f, kFaceCorners[2 * axis]), far_face(f, kFaceCorners[2 * axis + 1]);
            const MixedDeterminant mixed_faces(f, 1u << axis, 1u << (axis + 1) % 3, 1u << (axis + 2) % 3);
            const Signs near = near_face.signs(), far = far_face.signs(), mixed = mixed_faces.signs();
            set(near.positive, 2 * axis);
            set(far.positive, 2 * axis + 1);
            set(near.negative, FaceSigns::kNegative + 2 * axis);
            set(far.negative, FaceSigns::kNegative + 2 * axis + 1);
            const auto any_positive = hn::Or(near.positive, far.positive);
            const auto any_negative = hn::Or(near.negative, far.negative);
            set(hn::Or(hn::And(any_positive, hn::Or(any_negative, mixed.positive)),
                       hn::And(any_negative, mixed.negative)),
                FaceSigns::kNoWaist);
            // The hyperdeterminant is the same on every axis.
            if (axis == 0) set(without_crosses(near_face, far_face, mixed_faces), FaceSigns::kNoWaist);
        }
        hn::StoreU(bits, du, &signs[i].bits);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_signs_target);

void find_signs(const CellBatch& batch, std::size_t count, FaceSigns (&signs)[CellBatch::kCells]) {
    HWY_DYNAMIC_DISPATCH(find_signs_target)(batch, count, signs);
}

}  // namespace marrow::internal
#endif
