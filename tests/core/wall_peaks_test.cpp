// The search for peaks, which looks at many samples at a time, against the test of one sample.
#include "core/trust/peaks.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "core/trust/ridges.h"
#include "core/trust/sample_mask.h"
#include "support/fields.h"

namespace marrow::test {
namespace {

using namespace internal;
using Index = std::array<std::int64_t, 3>;

// Few values, so that there are ties; widths that end within a word, and rows shorter than the reach.
template <class T>
Volume random_volume(Random& random) {
    std::uniform_int_distribution<std::int64_t> size(1, 9), width(1, 150), value(0, 20);
    const double step = std::is_floating_point_v<T> ? 3.7 : 4;
    const std::int64_t nan = std::is_floating_point_v<T> ? value(random) : -1;
    return sampled<T>(grid(width(random), size(random), size(random)), [&](auto, auto, auto) {
        const std::int64_t v = value(random);
        return v == nan ? std::numeric_limits<double>::quiet_NaN() : step * static_cast<double>(v);
    });
}

template <class T>
class WallPeaks : public testing::Test {};
using SampleTypes =
    testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::int32_t, float, double>;
TYPED_TEST_SUITE(WallPeaks, SampleTypes);

TYPED_TEST(WallPeaks, KeepEveryRidgeOnEverySimdTarget) {
    Random random(3);
    std::int64_t all = 0, ridges = 0, kept = 0;
    for (int i = 0; i < 120; ++i) {
        const Volume owner = random_volume<TypeParam>(random);
        const VolumeView volume = owner;
        const Index dims = volume.geometry.dims;
        const RidgeTest<TypeParam> ridge_at(volume, std::uniform_real_distribution(20.0, 70.0)(random),
                                            i % 3);
        for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
            hwy::SetSupportedTargetsForTest(left & -left);
            hwy::GetChosenTarget().Update(hwy::SupportedTargets());
            for (std::int64_t z = 0; z < dims[2]; ++z) {
                for (std::int64_t y = 0; y < dims[1]; ++y) {
                    std::vector<std::uint64_t> words(static_cast<std::size_t>((dims[0] + 63) / 64),
                                                     ~std::uint64_t{0});
                    words.back() &= ~std::uint64_t{0} >> (63 - (dims[0] - 1) % 64);
                    keep_peaks(volume, ridge_at.limits(), y, z, words.data());
                    for (std::int64_t x = 0; x < dims[0]; ++x) {
                        const bool is_kept = (words[static_cast<std::size_t>(x / 64)] >> (x % 64) & 1) != 0;
                        const bool is_ridge = ridge_at({x, y, z}).has_value();
                        ASSERT_TRUE(is_kept || !is_ridge) << x << ' ' << y << ' ' << z << " of volume " << i;
                        all += 1, kept += is_kept, ridges += is_ridge;
                    }
                }
            }
            hwy::SetSupportedTargetsForTest(0);
            hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        }
    }
    EXPECT_GT(ridges, 1000);
    EXPECT_LT(kept, all / 4);
}

TEST(SampleMask, DilationAddsAllNeighbours) {
    Random random(4);
    for (int i = 0; i < 300; ++i) {
        std::uniform_int_distribution<std::int64_t> size(1, 7), width(1, 200);
        const Index dims{width(random), size(random), size(random)};
        std::vector<Index> inserted;
        SampleMask mask(dims);
        for (int n = 0; n < 5; ++n) {
            Index index;
            for (std::size_t a = 0; a < 3; ++a)
                index[a] = std::uniform_int_distribution<std::int64_t>(0, dims[a] - 1)(random);
            inserted.push_back(index);
            mask.insert(index);
        }
        mask.dilate();
        for (std::int64_t z = 0; z < dims[2]; ++z) {
            for (std::int64_t y = 0; y < dims[1]; ++y) {
                for (std::int64_t x = 0; x < 64 * ((dims[0] + 63) / 64); ++x) {
                    const bool expected =
                        x < dims[0] && std::any_of(inserted.begin(), inserted.end(), [&](const Index& at) {
                            return std::abs(at[0] - x) <= 1 && std::abs(at[1] - y) <= 1 &&
                                   std::abs(at[2] - z) <= 1;
                        });
                    ASSERT_EQ(mask.has({x, y, z}), expected) << x << ' ' << y << ' ' << z << " of mask " << i;
                }
            }
        }
    }
}

}  // namespace
}  // namespace marrow::test
