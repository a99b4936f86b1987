// Volumes whose samples stand for other values give what volumes of these values give.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>

#include <marrow/error.h>
#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/label_parts.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/parts.h>
#include <marrow/streaming.h>
#include <marrow/thin_walls.h>
#include <marrow/trust.h>
#include <marrow/volume_filters.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

constexpr Rescale kCt{1, -2643.4}, kHalf{0.5, -12.25}, kOdd{0.37, 1000.1};

// A head in air, with a skull and noise. The values of kCt are those of CT.
Volume head(const Rescale& rescale) {
    Random random(3);
    std::normal_distribution<double> noise(0, 12);
    Geometry g = grid(48, 44, 40);
    g.spacing = {0.8, 0.8, 1.5};
    g.origin = {-113.7, 41.3, 207.9};
    g.direction = {{{0.8, -0.6, 0}, {0.6, 0.8, 0}, {0, 0, 1}}};
    Volume volume = sampled<std::int16_t>(g, [&](auto x, auto y, auto z) {
        const double r = std::hypot(static_cast<double>(x) - 23.3, static_cast<double>(y) - 21.6,
                                    1.1 * static_cast<double>(z) - 20.2);
        const auto within = [r](double radius) { return 0.5 - 0.5 * std::erf(r - radius); };
        return 1640 + 1050 * within(19) + 1300 * (within(15) - within(12)) + noise(random);
    });
    volume.set_rescale(rescale);
    return volume;
}

// A frame of bone in air, and across it a wall that is too thin to reach the isovalue 2868.5.
Volume framed_wall(const Rescale& rescale) {
    Volume volume = sampled<std::int16_t>(grid(40, 40, 24), [](auto x, auto y, auto z) {
        const bool within = x > 6 && x < 33 && y > 6 && y < 33 && z > 6 && z < 17;
        const bool frame = within && !(x > 11 && x < 28 && y > 11 && y < 28);
        const bool wall = within && !frame && z == 12;
        return (frame ? 3843 : wall ? 2543 : 1643) + (x * 7 + y * 13 + z * 5) % 11 - 5;
    });
    volume.set_rescale(rescale);
    return volume;
}

VolumeView as_samples(const Volume& volume) {
    VolumeView view(volume);
    view.rescale = {};
    return view;
}

// What readers make of it without ScanOptions::keep_stored.
Volume as_values(const Volume& volume) {
    const Rescale r = volume.rescale();
    const auto [nx, ny, nz] = volume.geometry().dims;
    return sampled<float>(volume.geometry(), [&, nx = nx, ny = ny](auto x, auto y, auto z) {
        return r.slope * volume.samples<std::int16_t>()[(z * ny + y) * nx + x] + r.intercept;
    });
}

template <class T>
bool same_bytes(const Buffer<T>& a, const Buffer<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same(const Mesh& mesh, const Mesh& expected) {
    EXPECT_GT(mesh.triangles.size(), 1000u);
    EXPECT_TRUE(same_bytes(mesh.points, expected.points));
    EXPECT_TRUE(same_bytes(mesh.normals, expected.normals));
    EXPECT_TRUE(same_bytes(mesh.triangles, expected.triangles));
}

bool same_samples(const Volume& a, const Volume& b) {
    return a.type() == b.type() && a.bytes() == b.bytes() && std::memcmp(a.data(), b.data(), a.bytes()) == 0;
}

struct RescaleCase {
    const char* name;
    Rescale rescale;

    friend void PrintTo(const RescaleCase& c, std::ostream* out) { *out << c.name; }
};

class Rescaled : public testing::TestWithParam<RescaleCase> {
  protected:
    const Rescale rescale = GetParam().rescale;
    const Volume volume = head(rescale);
    const Volume values = as_values(volume);
    const double isovalue = rescale.value(2500.3);  // of bone
};

INSTANTIATE_TEST_SUITE_P(Rescales, Rescaled,
                         testing::Values(RescaleCase{"Ct", kCt}, RescaleCase{"Half", kHalf},
                                         RescaleCase{"Odd", kOdd}),
                         [](const auto& info) { return info.param.name; });

TEST_P(Rescaled, SurfacesAreThoseOfTheSamples) {
    const double sample = (isovalue - rescale.intercept) / rescale.slope;
    for (const IsosurfaceOptions& options :
         {IsosurfaceOptions{}, {.closed = true}, {.snap = 0.3}, {.closed = true, .topology = true}})
        expect_same(extract_isosurface(volume, isovalue, options),
                    extract_isosurface(as_samples(volume), sample, options));
    expect_same(extract_isosurface_classic(volume, isovalue, true),
                extract_isosurface_classic(as_samples(volume), sample, true));

    IsosurfaceExtractor extractor(volume), of_samples(as_samples(volume));
    for (const double more : {0.0, 90.7, -40.1}) {
        for (const int level : {0, 1})
            expect_same(extractor.extract(isovalue + more, level),
                        of_samples.extract((isovalue + more - rescale.intercept) / rescale.slope, level));
    }
    const std::array<std::int64_t, 3> first{3, 4, 5}, dims{40, 39, 33};
    expect_same(extract_isosurface(part_of(volume, first, dims), isovalue),
                extract_isosurface(part_of(as_samples(volume), first, dims), sample));
}

TEST_P(Rescaled, PartsAndSlabsHaveTheBytesOfTheWhole) {
    const auto whole = volume.geometry().dims;
    const Mesh expected = extract_isosurface(volume, isovalue, {.closed = true});
    std::vector<PartSurface> surfaces;
    std::vector<PartCounts> counts;
    const std::int64_t cut = 19;
    const VolumeView parts[] = {part_of(volume, {0, 0, 0}, {whole[0], whole[1], cut + 1}),
                                part_of(volume, {0, 0, cut}, {whole[0], whole[1], whole[2] - cut})};
    for (const VolumeView& part : parts) {
        surfaces.push_back(extract_part(part, whole, isovalue, {.closed = true}));
        counts.push_back(count_part(part, whole, isovalue, {.closed = true}));
    }
    expect_same(merge_parts(surfaces), expected);
    const std::vector<PartNumbers> numbers = number_parts(counts);
    std::size_t triangles = 0;
    for (std::size_t p = 0; p < 2; ++p) {
        for (const NumberedRun& run :
             extract_numbered_part(parts[p], numbers[p], isovalue, {.closed = true}).triangles)
            triangles += run.count;
    }
    EXPECT_EQ(triangles, expected.triangles.size());

    Mesh mesh;
    const std::size_t slice = volume.bytes() / static_cast<std::size_t>(whole[2]);
    const SliceSource source{.geometry = volume.geometry(),
                             .type = volume.type(),
                             .read =
                                 [&](std::int64_t begin, std::int64_t end, void* to) {
                                     std::memcpy(to,
                                                 static_cast<const std::byte*>(volume.data()) +
                                                     slice * static_cast<std::size_t>(begin),
                                                 slice * static_cast<std::size_t>(end - begin));
                                 },
                             .rescale = rescale};
    const SurfaceSink sink{
        [&](std::uint64_t points, std::uint64_t count, bool) {
            mesh.points.resize(points);
            mesh.normals.resize(points);
            mesh.triangles.resize(count);
        },
        [&](const SurfacePart& part) {
            const auto at = [](auto& all, std::uint64_t first) {
                return all.begin() + static_cast<std::ptrdiff_t>(first);
            };
            std::copy(part.points.begin(), part.points.end(), at(mesh.points, part.first_point));
            std::copy(part.normals.begin(), part.normals.end(), at(mesh.normals, part.first_point));
            std::copy(part.triangles.begin(), part.triangles.end(), at(mesh.triangles, part.first_triangle));
        }};
    extract_isosurface_in_slabs(source, isovalue, sink, {.slices = 7}, {.closed = true});
    expect_same(mesh, expected);
}

TEST_P(Rescaled, SurfacesAreCloseToThoseOfTheValues) {
    for (const IsosurfaceOptions& options : {IsosurfaceOptions{}, {.closed = true, .topology = true}}) {
        const Mesh mesh = extract_isosurface(volume, isovalue, options),
                   expected = extract_isosurface(values, isovalue, options);
        ASSERT_EQ(mesh.points.size(), expected.points.size());
        EXPECT_TRUE(same_bytes(mesh.triangles, expected.triangles));
        double furthest = 0, most_turned = 1;
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            furthest = std::max(furthest, length(to_double(mesh.points[i]) - to_double(expected.points[i])));
            most_turned =
                std::min(most_turned, dot(to_double(mesh.normals[i]), to_double(expected.normals[i])));
        }
        EXPECT_LT(furthest, 1e-3);
        EXPECT_GT(most_turned, 1 - 1e-4);
    }
}

TEST_P(Rescaled, HistogramsAreOfValues) {
    const double padding = rescale.value(1640);
    for (const std::optional<double>& left_out : {std::optional<double>(), {padding}}) {
        const Histogram found = histogram(volume, 64, left_out), expected = histogram(values, 64, left_out);
        EXPECT_NEAR(found.lower, expected.lower, 1e-3);
        EXPECT_NEAR(found.upper, expected.upper, 1e-3);
        std::int64_t all = 0, moved = 0;  // to another bin, by rounding
        for (std::size_t i = 0; i < 64; ++i) {
            all += found.counts[i];
            moved += std::abs(found.counts[i] - expected.counts[i]);
        }
        const auto samples = volume.samples<std::int16_t>();
        const std::int64_t count = volume.geometry().sample_count();
        EXPECT_EQ(all, left_out ? count - std::count(samples, samples + count, 1640) : count);
        EXPECT_LT(moved, count / 100);
        EXPECT_NEAR(otsu_isovalue(found), otsu_isovalue(expected), 1e-3);
        EXPECT_NEAR(otsu_contrast(found), otsu_contrast(expected), 1e-2 * otsu_contrast(expected));
    }
}

TEST_P(Rescaled, NoiseAndTrustAreThoseOfTheValues) {
    const NoiseEstimate noise = estimate_noise(volume), expected = estimate_noise(values);
    ASSERT_GT(noise.windows, 100);
    EXPECT_EQ(noise.windows, expected.windows);
    const double rounding = 1e-4 * expected.sigma;
    EXPECT_NEAR(noise.sigma, expected.sigma, rounding);
    EXPECT_NEAR(noise.local_deviation, expected.local_deviation, rounding);
    EXPECT_NEAR(noise.laplacian, expected.laplacian, rounding);
    EXPECT_NEAR(noise.slices.value(), expected.slices.value(), rounding);

    const Mesh mesh = extract_isosurface(volume, isovalue);
    const TrustReport report = report_trust(volume, mesh.points),
                      of_values = report_trust(values, mesh.points);
    EXPECT_NEAR(report.step, of_values.step, 1e-2 * of_values.step);
    const TrustReport by_100 = report_trust(volume, mesh.points, {.step = 100}),
                      expected_by_100 = report_trust(values, mesh.points, {.step = 100});
    EXPECT_NEAR(by_100.shifts.median, expected_by_100.shifts.median, 1e-4);
    EXPECT_NEAR(by_100.noise_shifts.percentile_90, expected_by_100.noise_shifts.percentile_90, 1e-4);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        ASSERT_NEAR(by_100.shift[i], expected_by_100.shift[i], 1e-3) << i;
}

TEST_P(Rescaled, ThinWallsAreThoseOfTheValues) {
    const Volume scan = framed_wall(rescale), of_values = as_values(scan);
    const double bone = rescale.value(2868.5);
    const Mesh surface = extract_isosurface(scan, bone, {.closed = true, .topology = true});
    const ThinWalls walls = find_thin_walls(scan, bone, surface),
                    expected = find_thin_walls(of_values, bone, surface);
    EXPECT_EQ(walls.walls.size(), 1u);
    EXPECT_EQ(expected.walls.size(), 1u);
    EXPECT_NEAR(walls.area, 16 * 16, 25);
    EXPECT_NEAR(walls.area, expected.area, 1e-3 * expected.area);
    // More noise hides it.
    EXPECT_TRUE(find_thin_walls(scan, bone, surface, {.noise = rescale.slope * 250}).walls.empty());

    const Volume restored = restore_thin_walls(scan, bone, walls),
                 restored_values = restore_thin_walls(of_values, bone, expected);
    EXPECT_EQ(restored.rescale(), rescale);
    const MeshMeasures found = measure(extract_isosurface(restored, bone, {.closed = true})),
                       wanted = measure(extract_isosurface(restored_values, bone, {.closed = true}));
    EXPECT_NEAR(found.volume, wanted.volume, 1e-3 * wanted.volume) << "rounded to whole samples";
    EXPECT_EQ(found.euler_characteristic, wanted.euler_characteristic);
    EXPECT_NE(found.euler_characteristic, measure(surface).euler_characteristic);
}

TEST_P(Rescaled, SweepsAreThoseOfTheValues) {
    const std::vector<double> isovalues{rescale.value(2000.4), rescale.value(2400.6), rescale.value(2700.3)};
    for (const bool topology : {false, true}) {
        const auto found = sweep_isovalues(volume, isovalues, {.topology = topology}),
                   expected = sweep_isovalues(values, isovalues, {.topology = topology});
        for (std::size_t i = 0; i < isovalues.size(); ++i) {
            EXPECT_EQ(found[i].isovalue, isovalues[i]);
            EXPECT_NEAR(found[i].volume, expected[i].volume, 1e-4 * expected[i].volume);
            EXPECT_NEAR(found[i].area, expected[i].area, 1e-4 * expected[i].area);
            EXPECT_EQ(found[i].components, expected[i].components);
            EXPECT_EQ(found[i].triangles, expected[i].triangles);
        }
    }
}

TEST_P(Rescaled, FiltersKeepTheRescaleOrGiveValues) {
    EXPECT_TRUE(same_samples(gaussian_filter(volume, 1.2), gaussian_filter(values, 1.2)));
    EXPECT_TRUE(same_samples(resample_isotropic(volume, 1), resample_isotropic(values, 1)));
    EXPECT_TRUE(gaussian_filter(volume, 1.2).rescale().is_identity());
    EXPECT_TRUE(resample_isotropic(volume, 1).rescale().is_identity());
    const Volume median = median_filter(volume, 1), cropped = crop(volume, {3, 4, 5}, {20, 21, 22});
    EXPECT_EQ(median.rescale(), rescale);
    EXPECT_EQ(cropped.rescale(), rescale);
    EXPECT_TRUE(same_samples(as_values(median), median_filter(values, 1)));
    EXPECT_TRUE(same_samples(as_values(cropped), crop(values, {3, 4, 5}, {20, 21, 22})));
}

// The padding of a scan is found among float32 values too.
TEST_P(Rescaled, PaddingIsLeftOutAfterAFilter) {
    Volume padded = volume;
    const std::int16_t outside = -2000;
    std::fill_n(padded.samples<std::int16_t>(), 5000, outside);
    const double padding = rescale.value(outside);
    EXPECT_NEAR(histogram(padded, 64, padding).lower, histogram(volume, 64).lower, 1e-9);
    const Volume resampled = resample_isotropic(padded, padded.geometry().spacing[0]);
    const Histogram all = histogram(resampled, 64), without = histogram(resampled, 64, padding);
    std::int64_t left_out = 0;
    for (std::size_t i = 0; i < 64; ++i) left_out += all.counts[i] - without.counts[i];
    EXPECT_GT(left_out, 1000);
}

TEST(Rescale, ASampleAtTheIsovalueIsInside) {
    Volume volume = one_voxel_thick_wall(5);
    volume.set_rescale(kHalf);
    const double wall = kHalf.value(1000);
    EXPECT_EQ(wall, 487.75);
    EXPECT_FALSE(extract_isosurface(volume, wall).triangles.empty());
    EXPECT_TRUE(extract_isosurface(volume, std::nextafter(wall, 1e9)).triangles.empty());
}

TEST(Rescale, AWholeSampleIsFoundByItsValue) {
    for (const Rescale& rescale : {kCt, kHalf, kOdd, Rescale{1.0 / 3, 1e5 / 7}, Rescale{3e-5, -0.1}}) {
        for (int sample = -32768; sample <= 65535; ++sample)
            ASSERT_EQ(rescale.sample(rescale.value(sample)), sample);
        EXPECT_NEAR(rescale.sample(rescale.value(17.3)), 17.3, 1e-6);
    }
}

TEST(Rescale, IsExactlyNothingForSamplesThatAreValues) {
    const Rescale identity;
    EXPECT_TRUE(identity.is_identity());
    EXPECT_TRUE(std::signbit(identity.value(-0.0)));
    EXPECT_TRUE(std::signbit(identity.sample(-0.0)));
    EXPECT_FALSE(kCt.is_identity());
    EXPECT_FALSE(kHalf.is_identity());
}

TEST(Rescale, OfViewsIsThatOfTheirVolume) {
    const Volume volume = head(kOdd);
    EXPECT_EQ(VolumeView(volume).rescale, kOdd);
    EXPECT_EQ(part_of(volume, {1, 1, 1}, {3, 3, 3}).rescale, kOdd);
}

TEST(Rescale, BadNumbersAreRefused) {
    Volume volume = one_voxel_thick_wall(3);
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    for (const Rescale& bad :
         {Rescale{0, 0}, {-1, 0}, {nan, 0}, {infinity, 0}, {1e-300, 0}, {1, nan}, {1, infinity}}) {
        EXPECT_THROW(volume.set_rescale(bad), InputError);
        VolumeView view(volume);
        view.rescale = bad;
        EXPECT_THROW(extract_isosurface(view, 1), InputError);
        EXPECT_THROW(histogram(view), InputError);
        EXPECT_THROW(IsosurfaceExtractor{view}, InputError);
    }
}

TEST(Rescale, LabelMapsHaveNone) {
    Volume map = one_voxel_thick_wall(5);
    map.set_rescale(kHalf);
    EXPECT_THROW(extract_labels(map), InputError);
    EXPECT_THROW(count_labels(map), InputError);
    EXPECT_THROW(extract_label_part(map, {5, 5, 5}), InputError);
}

}  // namespace
}  // namespace marrow::test
