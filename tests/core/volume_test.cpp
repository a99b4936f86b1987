// Sample types, and views that every function refuses.
#include <gtest/gtest.h>

#include <marrow/error.h>
#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/labels.h>
#include <marrow/streaming.h>
#include <marrow/volume.h>
#include <marrow/volume_filters.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

TEST(Volume, VisitsTheTypeOfItsSamples) {
    for (const SampleType type : {SampleType::uint8, SampleType::int8, SampleType::uint16, SampleType::int16,
                                  SampleType::int32, SampleType::float32, SampleType::float64}) {
        const auto [visited, size] = visit_sample_type(
            type, [](auto sample) { return std::pair(sample_type_of<decltype(sample)>(), sizeof(sample)); });
        EXPECT_EQ(visited, type);
        EXPECT_EQ(size, sample_size(type));
    }
}

// Expects an InputError from every function that takes a view.
void expect_refused_everywhere(const VolumeView& view) {
    EXPECT_THROW(extract_isosurface(view, 1), InputError);
    EXPECT_THROW(IsosurfaceExtractor{view}, InputError);
    EXPECT_THROW(extract_isosurface_classic(view, 1), InputError);
    EXPECT_THROW(extract_labels(view), InputError);
    EXPECT_THROW(count_labels(view), InputError);
    EXPECT_THROW(sweep_isovalues(view, std::vector<double>{1, 2}), InputError);
    EXPECT_THROW(histogram(view), InputError);
    EXPECT_THROW(crop(view, {0, 0, 0}, {1, 1, 1}), InputError);
    EXPECT_THROW(crop(view, Box{{0, 0, 0}, {2, 2, 2}}), InputError);
    EXPECT_THROW(median_filter(view, 1), InputError);
    EXPECT_THROW(gaussian_filter(view, 1), InputError);
    EXPECT_THROW(resample_isotropic(view, 0.5), InputError);
    EXPECT_THROW(part_of(view, {0, 0, 0}, {2, 2, 2}), InputError);
}

TEST(Volume, EveryFunctionRefusesANullView) {
    VolumeView null;
    null.geometry = grid(4, 5, 6);
    null.type = SampleType::int16;
    expect_refused_everywhere(null);
    const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
    EXPECT_THROW(extract_isosurface_in_slabs({null.geometry, null.type, {}}, 1, sink, {}), InputError);
}

TEST(Volume, AViewWithoutSamplesMayBeNull) {
    VolumeView empty;
    EXPECT_TRUE(extract_isosurface(empty, 1).points.empty());
    EXPECT_TRUE(extract_labels(empty).empty());
    EXPECT_TRUE(histogram(empty).counts.empty());
    EXPECT_EQ(median_filter(empty, 1).bytes(), 0u);
}

TEST(Volume, EveryFunctionRefusesAViewThatOverlapsOrLeavesTheWhole) {
    const Volume volume = checkerboard(6);
    std::vector<VolumeView> bad(11, VolumeView(volume));
    bad[0].pitch = {5, 36};
    bad[1].pitch = {6, 35};
    bad[2].pitch = {-6, 36};
    bad[3].first = {-1, 0, 0};
    bad[4].below = {1, 0, 0};                 // more than `first`
    bad[5].first = bad[5].below = {1, 0, 0};  // the row before and this one would share a sample
    bad[6].above = {0, 0, -1};
    bad[7].first = {std::int64_t{1} << 40, 0, 0};
    bad[8].pitch = {std::int64_t{1} << 60, std::int64_t{1} << 62};
    // 2^20 rows are 2^64 samples away, or 2^63 by default.
    bad[9].geometry.dims = bad[10].geometry.dims = {6, (1 << 20) + 1, 2};
    bad[9].pitch = {std::int64_t{1} << 44, 6};
    bad[10].pitch = {std::int64_t{1} << 43, 0};
    for (const VolumeView& view : bad) expect_refused_everywhere(view);
    EXPECT_THROW(part_of(volume, {0, 0, 5}, {2, 2, 2}), InputError);
    EXPECT_THROW(part_of(volume, {-1, 0, 0}, {2, 2, 2}), InputError);
}

}  // namespace
}  // namespace marrow::test
