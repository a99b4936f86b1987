// Histograms of all sample types, and isovalues by Otsu's method.
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include <marrow/error.h>
#include <marrow/histogram.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMax = std::numeric_limits<double>::max();

template <class T>
Volume row(const std::vector<T>& values) {
    const auto begin = values.begin();
    return sampled<T>(grid(static_cast<std::int64_t>(values.size()), 1, 1),
                      [&](auto x, auto, auto) { return begin[x]; });
}

Histogram histogram_of(const Volume& volume, int bins = 256, std::optional<double> padding = {}) {
    return histogram(volume, bins, padding);
}

TEST(Histogram, CountsEveryFiniteSampleOnce) {
    const Histogram h = histogram_of(row<double>({-3, kNan, 0, 1, 5, HUGE_VAL, 5}), 4);  // bins 2 wide
    EXPECT_EQ(h.lower, -3);
    EXPECT_EQ(h.upper, 5);
    EXPECT_EQ(h.counts, (std::vector<std::int64_t>{1, 1, 1, 2}));
    EXPECT_EQ(h.non_finite_samples, 2);
}

TEST(Histogram, SpansTheWholeRangeOfEachType) {
    const Histogram doubles = histogram_of(row<double>({-kMax, 0, kMax}), 2);
    EXPECT_EQ(doubles.lower, -kMax);
    EXPECT_EQ(doubles.upper, kMax);
    EXPECT_EQ(doubles.counts, (std::vector<std::int64_t>{1, 2}));
    const Histogram ints = histogram_of(row<std::int32_t>({INT32_MIN, -1, 0, INT32_MAX}), 2);
    EXPECT_EQ(ints.counts, (std::vector<std::int64_t>{2, 2}));
}

TEST(Histogram, LeavesOutPadding) {
    const Volume volume = row<std::int16_t>({-50, 700, 700, 0, 50, 700});
    const Histogram h = histogram(volume, 4, 700);
    EXPECT_EQ(h.lower, -50);
    EXPECT_EQ(h.upper, 50);
    EXPECT_EQ(h.counts, (std::vector<std::int64_t>{1, 0, 1, 1}));
    EXPECT_EQ(histogram(volume, 4, 701).counts, histogram(volume, 4).counts) << "no sample is padding";
    // Of two values, both count.
    EXPECT_EQ(histogram_of(row<float>({0, 0, 1}), 2, 0.0).counts, (std::vector<std::int64_t>{2, 1}));
    EXPECT_EQ(histogram_of(row<float>({3, 3}), 2, 3.0).lower, 3);
    EXPECT_EQ(histogram_of(row<float>({3, NAN, NAN}), 2, 3.0).non_finite_samples, 2);
}

// Small integers are counted by value before they are put in bins, if there are enough of them.
TEST(Histogram, OfSmallIntegersIsThatOfLargeOnes) {
    Random random(5);
    for (const int range : {2, 3, 100, 255, 4000, 65536}) {
        for (const std::int64_t side : {3, 20, 50}) {
            const auto value = [&](auto, auto, auto) {
                return static_cast<std::int16_t>(static_cast<int>(random() % range) - range / 2);
            };
            const Volume small = sampled<std::int16_t>(grid(side, side, side), value);
            const std::int16_t* samples = small.samples<std::int16_t>();
            const Volume large = sampled<std::int32_t>(grid(side, side, side), [&](auto x, auto y, auto z) {
                return samples[(z * side + y) * side + x];
            });
            for (const std::optional<double> padding : {std::optional<double>{}, {-range / 2}, {0}}) {
                const Histogram found = histogram(small, 256, padding),
                                expected = histogram(large, 256, padding);
                EXPECT_EQ(found.counts, expected.counts) << range << " " << side;
                EXPECT_EQ(found.lower, expected.lower);
                EXPECT_EQ(found.upper, expected.upper);
            }
        }
    }
}

TEST(Histogram, TakesConstantAndEmptyVolumes) {
    EXPECT_EQ(histogram_of(row<std::uint8_t>({7, 7, 7}), 2).counts, (std::vector<std::int64_t>{3, 0}));
    EXPECT_TRUE(histogram_of(row<float>({NAN, NAN})).counts.empty());
    EXPECT_TRUE(histogram_of(Volume(grid(0, 4, 4), SampleType::int16)).counts.empty());
    EXPECT_THROW(histogram_of(row<std::uint8_t>({1, 2}), 1), InputError);
}

TEST(Otsu, LiesMidwayBetweenTwoSeparatePeaks) {
    EXPECT_NEAR(otsu_isovalue(histogram_of(row<std::int16_t>({-1000, -1000, -1000, 1000}))), 0, 10);
    EXPECT_NEAR(otsu_isovalue(histogram_of(row<double>({-kMax, kMax}))) / kMax, 0, 0.01);
}

// Computes the variance between the two classes from its definition, without running sums.
TEST(Otsu, HasTheLargestVarianceBetweenClasses) {
    Random random(1);
    for (int round = 0; round < 20; ++round) {
        Histogram h;
        h.lower = -5;
        h.upper = 27;
        h.counts.resize(32);
        for (auto& count : h.counts) count = static_cast<std::int64_t>(random() % 100);
        const auto variance = [&](double isovalue) {
            double n[2] = {0, 0}, sum[2] = {0, 0};
            for (int bin = 0; bin < 32; ++bin) {
                const double centre = -5 + bin + 0.5;
                const int side = centre >= isovalue;
                n[side] += static_cast<double>(h.counts[static_cast<std::size_t>(bin)]);
                sum[side] += static_cast<double>(h.counts[static_cast<std::size_t>(bin)]) * centre;
            }
            return n[0] * n[1] == 0 ? 0 : n[0] * n[1] * std::pow(sum[0] / n[0] - sum[1] / n[1], 2);
        };
        const double chosen = variance(otsu_isovalue(h));
        for (int border = -5; border <= 27; ++border) EXPECT_LE(variance(border), chosen * (1 + 1e-12));
    }
}

// A CT that is padded outside the field of view: 40 % padding, 40 % air, 20 % tissue.
TEST(Otsu, LeavesOutPadding) {
    const auto ct = [](std::int16_t padding) {
        std::vector<std::int16_t> samples;
        for (int i = 0; i < 400; ++i) samples.push_back(padding);
        for (int i = 0; i < 400; ++i) samples.push_back(static_cast<std::int16_t>(-1000 + i % 50));
        for (int i = 0; i < 200; ++i) samples.push_back(static_cast<std::int16_t>(i % 60));
        return histogram_of(row(samples));
    };
    for (const std::int16_t padding : {-3024, -2048, -2000}) {
        EXPECT_NEAR(otsu_isovalue(ct(padding)), -475, 60) << padding;
        EXPECT_NEAR(otsu_contrast(ct(padding)), 1005, 30) << padding;
    }
    // Two values are two classes, whatever they are.
    EXPECT_NEAR(otsu_isovalue(histogram_of(row<std::int16_t>({-2000, -2000, 100}))), -950, 10);
    // The background of a masked scan, at zero, is a class and no padding.
    EXPECT_LT(otsu_isovalue(histogram_of(row<std::int16_t>({0, 0, 0, 0, 900, 1000, 1100}))), 900);
}

TEST(Otsu, ContrastIsTheDistanceOfTheClasses) {
    EXPECT_NEAR(otsu_contrast(histogram_of(row<std::int16_t>({-1000, -1000, 40, 60}))), 1050, 5);
    EXPECT_NEAR(otsu_contrast(histogram_of(row<float>({0, 0, 0, 1, 1}))), 1, 1.0 / 128);
    EXPECT_EQ(otsu_contrast(histogram_of(row<float>({3, 3, 3}))), 0);
    EXPECT_EQ(otsu_contrast(Histogram{}), 0);
    EXPECT_EQ(otsu_contrast(histogram_of(row<double>({-1.7e308, -1.7e308, 1.7e308}))), 0) << "beyond doubles";
}

TEST(Otsu, RefusesOneValue) {
    EXPECT_THROW(otsu_isovalue(histogram_of(row<float>({3, 3, 3}))), InputError);
    EXPECT_THROW(otsu_isovalue(Histogram{}), InputError);
}

}  // namespace
}  // namespace marrow::test
