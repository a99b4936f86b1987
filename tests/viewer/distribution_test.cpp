// Tests the bins of the viewer's histogram.
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "model/distribution.h"

namespace marrow::viewer {
namespace {

template <class T>
Volume volume_of(const std::vector<T>& values, SampleType type) {
    Geometry geometry;
    geometry.dims = {static_cast<std::int64_t>(values.size()), 1, 1};
    Volume volume(geometry, type);
    std::copy(values.begin(), values.end(), volume.samples<T>());
    return volume;
}

double sum(const Bins& bins) {
    return std::accumulate(bins.counts.begin(), bins.counts.end(), 0.0);
}

// Each integer is in one bin, and all bins hold the same number of integers.
TEST(Distribution, BinsOfIntegersAreAlignedWithThem) {
    std::mt19937 random(1);
    std::vector<std::int16_t> values(20000);
    std::map<int, int> expected;
    for (auto& value : values)
        ++expected[value = static_cast<std::int16_t>(std::normal_distribution(100.0, 300.0)(random))];
    const Volume volume = volume_of(values, SampleType::int16);
    const Distribution distribution(volume, histogram(volume));
    for (const double zoom : {4000.0, 613.0, 90.0, 12.5}) {
        const Bins bins = distribution.bins(50, 50 + zoom, 200);
        EXPECT_EQ(bins.width, std::round(bins.width));
        EXPECT_GE(bins.width, 1);
        EXPECT_EQ(bins.first, std::floor(bins.first) + 0.5);
        EXPECT_LE(bins.first, 50);
        EXPECT_EQ(std::fmod(bins.first + 0.5, bins.width), 0);
        for (std::size_t b = 0; b < bins.counts.size(); ++b) {
            int samples = 0;
            for (int i = 0; i < static_cast<int>(bins.width); ++i) {
                const int value =
                    static_cast<int>(bins.first + 0.5 + bins.width * static_cast<double>(b)) + i;
                const auto it = expected.find(value);
                samples += it == expected.end() ? 0 : it->second;
            }
            ASSERT_NEAR(bins.counts[b], samples, 1e-6) << zoom << " bin " << b;
        }
    }
}

TEST(Distribution, IntegersThatStandForFractionsAreNone) {
    Volume volume = volume_of(std::vector<std::int16_t>{0, 1, 2, 7}, SampleType::int16);
    EXPECT_TRUE(has_integers(volume));
    volume.set_rescale({0.5, -1000.25});
    EXPECT_FALSE(has_integers(volume));
    const Bins bins = Distribution(volume, histogram(volume)).bins(-1000.25, -996.75, 35);
    EXPECT_NEAR(sum(bins), 4, 1e-9);
    EXPECT_LT(bins.width, 0.5);
}

// A zoomed part has bins of its own, not magnified ones.
TEST(Distribution, CountsFractionsAnewWhenZoomed) {
    std::mt19937 random(2);
    std::vector<float> values(50000);
    for (float& value : values) value = std::uniform_real_distribution<float>(0, 1)(random);
    for (int i = 0; i < 1000; ++i) values.push_back(0.5F);  // a peak that is narrower than any coarse bin
    const Volume volume = volume_of(values, SampleType::float32);
    const Distribution distribution(volume, histogram(volume));
    const Bins all = distribution.bins(0, 1, 200);
    EXPECT_NEAR(sum(all), 51000, 1e-6 * 51000);
    const Bins part = distribution.bins(0.4985, 0.5025, 200);
    EXPECT_GT(part.counts.size(), 100u);
    EXPECT_LT(part.width, 1e-4);
    const auto peak = std::max_element(part.counts.begin(), part.counts.end());
    const double at = part.first + part.width * static_cast<double>(peak - part.counts.begin());
    EXPECT_NEAR(at, 0.5, 2 * part.width);
    EXPECT_GT(*peak, 700);  // the border of two bins may divide it
}

TEST(Distribution, OutliersDoNotStretchTheRange) {
    Histogram h{-32768, 3071, std::vector<std::int64_t>(256, 0), 0};
    const auto bin = [&](double value) {
        return static_cast<std::size_t>((value - h.lower) / (h.upper - h.lower) * 256);
    };
    for (double value = -1000; value < 2000; value += 100) h.counts[bin(value)] += 10000;
    h.counts[0] = 20;  // padding
    const ValueRange range = usual_range(h);
    EXPECT_LT(range.lower, -1000);
    EXPECT_GT(range.lower, -1700);
    EXPECT_GT(range.upper, 2000);
    EXPECT_LE(range.upper, 3071);
    // Nothing is cut off where all values are common.
    const Histogram even{0, 255, std::vector<std::int64_t>(256, 100), 0};
    EXPECT_EQ(usual_range(even).lower, 0);
    EXPECT_EQ(usual_range(even).upper, 255);
}

TEST(Distribution, SurvivesExtremeRanges) {
    constexpr double kMost = std::numeric_limits<double>::max();
    const Volume volume = volume_of<double>({-kMost, 0, kMost}, SampleType::float64);
    const Histogram h = histogram(volume);
    EXPECT_EQ(Distribution(volume, h).bins(-kMost, kMost, 100).counts.size(), 1u);
    EXPECT_LE(Distribution(volume, h).bins(0.3, std::nextafter(0.3, 1), 1e6).counts.size(), 3u);
    const Volume same = volume_of<std::int16_t>({7, 7}, SampleType::int16);
    const Histogram one = histogram(same);
    const ValueRange range = usual_range(one);
    EXPECT_EQ(sum(Distribution(same, one).bins(range.lower, range.upper, 100)), 2);
}

}  // namespace
}  // namespace marrow::viewer
