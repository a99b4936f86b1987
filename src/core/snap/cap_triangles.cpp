// Finds the triangles whose height is small compared with their longest side, in batches of vectors.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/cap_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "cap_triangles.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kBatch = 64;

// Writes two sides of each triangle as four floats each. The fourth is not used.
HWY_INLINE void write_sides(const Vec3f* points, const Triangle* triangles, std::size_t count,
                            float* HWY_RESTRICT u, float* HWY_RESTRICT v) {
    const hn::CappedTag<float, 4> d;
    for (std::size_t k = 0; k < count; ++k) {
        const auto [p, q, r] = triangles[k];
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            const auto origin = hn::LoadU(d, points[p].data() + i);
            hn::Store(hn::Sub(hn::LoadU(d, points[q].data() + i), origin), d, u + 4 * k + i);
            hn::Store(hn::Sub(hn::LoadU(d, points[r].data() + i), origin), d, v + 4 * k + i);
        }
    }
}

void find_caps_target(const Vec3f* points, const Triangle* triangles, std::size_t count,
                      std::vector<std::uint32_t>& caps) {
    const hn::CappedTag<float, 8> d;
    using V = hn::Vec<decltype(d)>;
    HWY_ALIGN float u[4 * kBatch] = {}, v[4 * kBatch] = {};
    // The margin allows for rounding.
    constexpr auto kSine = static_cast<float>(1.01 * kCapSlope);
    const V squared_sine = hn::Set(d, kSine * kSine);
    const auto squared = [](V x, V y, V z) HWY_ATTR {
        return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    };
    const auto minor = [](V a, V b, V c, V e) HWY_ATTR { return hn::Sub(hn::Mul(a, b), hn::Mul(c, e)); };
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
        const std::size_t size = std::min(kBatch, count - begin);
        write_sides(points, triangles + begin, size, u, v);
        for (std::size_t k = 0; k < size; k += hn::Lanes(d)) {
            V ux, uy, uz, vx, vy, vz, unused;
            hn::LoadInterleaved4(d, u + 4 * k, ux, uy, uz, unused);
            hn::LoadInterleaved4(d, v + 4 * k, vx, vy, vz, unused);
            const V uu = squared(ux, uy, uz), vv = squared(vx, vy, vz),
                    ww = squared(hn::Sub(ux, vx), hn::Sub(uy, vy), hn::Sub(uz, vz));
            const V longest = hn::Max(hn::Max(uu, vv), ww);
            // Twice the area is the longest side times the height.
            const V squared_area =
                squared(minor(uy, vz, uz, vy), minor(uz, vx, ux, vz), minor(ux, vy, uy, vx));
            const auto is_low = hn::Lt(squared_area, hn::Mul(squared_sine, hn::Mul(longest, longest)));
            if (HWY_LIKELY(hn::AllFalse(d, is_low))) continue;
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, is_low, bits);
            for (std::size_t i = 0; i < hn::Lanes(d) && k + i < size; ++i) {
                if (bits[0] >> i & 1) caps.push_back(static_cast<std::uint32_t>(begin + k + i));
            }
        }
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_caps_target);

void find_caps(const Vec3f* points, const Triangle* triangles, std::size_t count,
               std::vector<std::uint32_t>& caps) {
    HWY_DYNAMIC_DISPATCH(find_caps_target)(points, triangles, count, caps);
}

}  // namespace marrow::internal
#endif
