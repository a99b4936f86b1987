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

using Doubles = hn::CappedTag<double, CellBatch::kCells>;
using DoubleVec = hn::Vec<Doubles>;
using LaneMask = hn::Mask<Doubles>;

struct Signs {
    LaneMask positive, negative;
};

// Rounding is monotonic, so rounded products are never in the wrong order. Neither is true for NaN.
HWY_INLINE Signs determinant_signs(const DoubleVec (&f)[8], const std::uint8_t (&ring)[4]) {
    const auto first = hn::Mul(f[ring[0]], f[ring[2]]), second = hn::Mul(f[ring[1]], f[ring[3]]);
    return {hn::Gt(first, second), hn::Lt(first, second)};
}

// The signs of the mixed determinants of the faces across an axis, whose first corners are 0 and `across`.
HWY_INLINE Signs mixed_signs(const DoubleVec (&f)[8], unsigned across, unsigned u, unsigned v) {
    const Doubles d;
    const auto a = hn::Mul(f[0], f[across | u | v]), b = hn::Mul(f[u | v], f[across]);
    const auto c = hn::Mul(f[v], f[across | u]), e = hn::Mul(f[u], f[across | v]);
    const auto value = hn::Sub(hn::Add(a, b), hn::Add(c, e));
    const auto magnitude = hn::Add(hn::Add(hn::Abs(a), hn::Abs(b)), hn::Add(hn::Abs(c), hn::Abs(e)));
    // Rounding errors are less than this, also those of products that are nearly too small for doubles.
    const auto doubt = hn::Add(hn::Mul(magnitude, hn::Set(d, 16 * 0x1p-53)), hn::Set(d, 0x1p-1000));
    return {hn::Gt(value, doubt), hn::Lt(value, hn::Neg(doubt))};
}

void find_signs_target(const CellBatch& batch, FaceSigns* signs) {
    const Doubles d;
    const hn::RebindToUnsigned<Doubles> du;
    static_assert(sizeof(FaceSigns) == sizeof(std::uint64_t));
    for (std::size_t i = 0; i < CellBatch::kCells; i += hn::Lanes(d)) {
        DoubleVec f[8];
        for (std::size_t v = 0; v < 8; ++v) f[v] = hn::Load(d, batch.corners[v] + i);
        auto bits = hn::Zero(du);
        const auto set = [&](LaneMask which, unsigned bit) HWY_ATTR {
            const auto one = hn::Set(du, std::uint64_t{1} << bit);
            bits = hn::Or(bits, hn::IfThenElseZero(hn::RebindMask(du, which), one));
        };
        for (unsigned axis = 0; axis < 3; ++axis) {
            const Signs near = determinant_signs(f, kFaceCorners[2 * axis]);
            const Signs far = determinant_signs(f, kFaceCorners[2 * axis + 1]);
            const Signs mixed = mixed_signs(f, 1u << axis, 1u << (axis + 1) % 3, 1u << (axis + 2) % 3);
            set(near.positive, 2 * axis);
            set(far.positive, 2 * axis + 1);
            set(near.negative, FaceSigns::kNegative + 2 * axis);
            set(far.negative, FaceSigns::kNegative + 2 * axis + 1);
            const auto any_positive = hn::Or(near.positive, far.positive);
            const auto any_negative = hn::Or(near.negative, far.negative);
            set(hn::Or(hn::And(any_positive, hn::Or(any_negative, mixed.positive)),
                       hn::And(any_negative, mixed.negative)),
                FaceSigns::kNoWaist);
        }
        hn::StoreU(bits, du, &signs[i].bits);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_signs_target);

void find_signs(const CellBatch& batch, FaceSigns (&signs)[CellBatch::kCells]) {
    HWY_DYNAMIC_DISPATCH(find_signs_target)(batch, signs);
}

}  // namespace marrow::internal
#endif
