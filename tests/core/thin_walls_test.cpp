// Walls that fall below the isovalue, on plates whose blurred shape has a formula.
#include <marrow/thin_walls.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

constexpr double kBlur = 0.75, kAir = -1000, kBone = 1500, kIsovalue = 225.5, kOpening = 14, kFrame = 4;

// The part of a Gaussian around x between -half and half.
double covered(double x, double half) {
    const double scale = std::numbers::sqrt2 * kBlur;
    return (std::erf((x + half) / scale) - std::erf((x - half) / scale)) / 2;
}

// A frame, and a plate of a thickness across it, turned by the angle around y. Samples are 1 mm apart.
double framed_plate(Vec3d p, double thickness, double angle) {
    const double x = std::cos(angle) * p[0] - std::sin(angle) * p[2],
                 z = std::sin(angle) * p[0] + std::cos(angle) * p[2];
    const double out = kOpening / 2 + kFrame, height = 3;
    const double frame =
        (covered(x, out) * covered(p[1], out) - covered(x, kOpening / 2) * covered(p[1], kOpening / 2)) *
        covered(z, height);
    const double plate = covered(x, kOpening / 2) * covered(p[1], kOpening / 2) * covered(z, thickness / 2);
    return std::lerp(kAir, kBone, frame + plate);
}

Geometry around_origin(std::int64_t n) {
    Geometry g = grid(n, n, n);
    g.origin = {-0.5 * static_cast<double>(n - 1) + 0.2, -0.5 * static_cast<double>(n - 1),
                -0.5 * static_cast<double>(n - 1) + 0.1};
    return g;
}

Volume plate_scan(double thickness, double angle = 0.2, double noise = 0) {
    Random random(5);
    std::normal_distribution<double> error(0, noise);
    return sampled_in_space<std::int16_t>(around_origin(32), [&](const Vec3d& p) {
        return std::lround(framed_plate(p, thickness, angle) + (noise > 0 ? error(random) : 0));
    });
}

Mesh surface_of(const Volume& volume) {
    return extract_isosurface(volume, kIsovalue, {.closed = true, .topology = true});
}

// An open frame has a handle, and a closed one has none.
TEST(ThinWalls, APlateThatVanishedIsFoundAndRestored) {
    for (const auto& [angle, noise] :
         {std::pair{0.0, 0.0}, {0.2, 0.0}, {0.4, 0.0}, {0.0, 20.0}, {0.2, 20.0}}) {
        const Volume volume = plate_scan(0.7, angle, noise);
        const Mesh mesh = surface_of(volume);
        ASSERT_EQ(measure(mesh).euler_characteristic, 0) << angle;
        const ThinWalls walls = find_thin_walls(volume, kIsovalue, mesh, {.noise = noise});
        ASSERT_FALSE(walls.walls.empty()) << angle;
        // The plate is hidden except beside the frame, whose blur raises it within about a sample.
        EXPECT_GT(walls.area, (kOpening - 2.5) * (kOpening - 2.5)) << angle;
        EXPECT_LT(walls.area, (kOpening + 1) * (kOpening + 1)) << angle;
        EXPECT_LT(length(walls.walls.front().position), 2);
        const Mesh restored = surface_of(restore_thin_walls(volume, kIsovalue, walls));
        EXPECT_EQ(manifold_fault(restored), "");
        EXPECT_EQ(measure(restored).euler_characteristic, 2) << angle;
        EXPECT_EQ(measure(restored).components, 1);
    }
}

// Half of the peak of the blurred profile: the x at which covered(x) is half of covered(0).
double restored_half_thickness(double thickness) {
    double low = 0, high = 5;
    for (int i = 0; i < 60; ++i) {
        const double x = (low + high) / 2;
        (covered(x, thickness / 2) > covered(0, thickness / 2) / 2 ? low : high) = x;
    }
    return low;
}

TEST(ThinWalls, ARestoredPlateIsAsThickAsTheBlurAndAsLargeAsItIs) {
    for (const double thickness : {0.65, 0.8}) {
        const Volume volume = plate_scan(thickness);
        const Mesh mesh = surface_of(volume);
        const Mesh restored = surface_of(
            restore_thin_walls(volume, kIsovalue, find_thin_walls(volume, kIsovalue, mesh, {.noise = 20})));
        // Both sides of the plate, away from the frame.
        double area = 0, volume_of_plate = 0;
        for (const Triangle& t : restored.triangles) {
            const Vec3d a = to_double(restored.points[t[0]]), b = to_double(restored.points[t[1]]),
                        c = to_double(restored.points[t[2]]);
            const Vec3d centre = (1.0 / 3) * (a + b + c), normal = 0.5 * cross(b - a, c - a);
            const Vec3d up{std::sin(0.2), 0, std::cos(0.2)};
            const double x = std::cos(0.2) * centre[0] - std::sin(0.2) * centre[2];
            if (std::abs(x) > 5 || std::abs(centre[1]) > 5) continue;
            area += std::abs(dot(normal, up));
            volume_of_plate += dot(normal, up) * dot(centre, up);
        }
        EXPECT_NEAR(area, 2 * 10 * 10, 0.08 * 2 * 10 * 10);
        EXPECT_NEAR(volume_of_plate / (area / 2), 2 * restored_half_thickness(thickness), 0.12) << thickness;
    }
}

TEST(ThinWalls, ThickBodiesHaveNone) {
    Random random(6);
    std::normal_distribution<double> error(0, 25);
    const Volume ball = sampled_in_space<std::int16_t>(around_origin(32), [&](const Vec3d& p) {
        return std::lround(
            std::lerp(kBone, kAir, 0.5 + 0.5 * std::erf((length(p) - 11) / std::numbers::sqrt2)) +
            error(random));
    });
    EXPECT_EQ(find_thin_walls(ball, kIsovalue, surface_of(ball), {.noise = 20}).area, 0);
    // The sharp edges of the frame can look like walls.
    const Volume thick = plate_scan(2.5);
    const Mesh mesh = surface_of(thick);
    EXPECT_LT(find_thin_walls(thick, kIsovalue, mesh, {.noise = 20}).area, 0.015 * measure(mesh).area);
}

// Between two balls that nearly touch, the samples have a saddle below the isovalue. It is no wall.
TEST(ThinWalls, ANarrowGapHasNone) {
    for (const double gap : {0.6, 1.0, 1.5}) {
        const Volume volume = sampled_in_space<std::int16_t>(around_origin(40), [&](const Vec3d& p) {
            const double nearest =
                std::min(length(p - Vec3d{-8 - gap / 2, 0, 0}), length(p - Vec3d{8 + gap / 2, 0, 0})) - 8;
            return std::lround(
                std::lerp(kBone, kAir, 0.5 + 0.5 * std::erf(nearest / (std::numbers::sqrt2 * kBlur))));
        });
        EXPECT_EQ(find_thin_walls(volume, kIsovalue, surface_of(volume), {.noise = 20}).area, 0) << gap;
    }
}

TEST(ThinWalls, NoiseHidesWhatItWouldOtherwiseFind) {
    const Volume volume = plate_scan(0.7);
    const Mesh mesh = surface_of(volume);
    EXPECT_GT(find_thin_walls(volume, kIsovalue, mesh, {.noise = 20}).area, 100);
    EXPECT_EQ(find_thin_walls(volume, kIsovalue, mesh, {.noise = 400}).area, 0);
}

TEST(ThinWalls, RestoringOnlyRaisesSamplesNearWalls) {
    const Volume volume = plate_scan(0.7);
    const ThinWalls walls = find_thin_walls(volume, kIsovalue, surface_of(volume), {.noise = 20});
    const Volume restored = restore_thin_walls(volume, kIsovalue, walls);
    const Volume same = restore_thin_walls(volume, kIsovalue, {});
    for (std::int64_t i = 0; i < volume.geometry().sample_count(); ++i) {
        EXPECT_GE(restored.samples<std::int16_t>()[i], volume.samples<std::int16_t>()[i]);
        EXPECT_EQ(same.samples<std::int16_t>()[i], volume.samples<std::int16_t>()[i]);
    }
}

TEST(ThinWalls, PointsBesideThemAreTheRimOfTheOpening) {
    const Volume volume = plate_scan(0.7, 0);
    const Mesh mesh = surface_of(volume);
    const std::vector<bool> near =
        near_thin_walls(volume, find_thin_walls(volume, kIsovalue, mesh, {.noise = 20}), mesh.points);
    std::int64_t rim = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        const Vec3f& p = mesh.points[i];
        if (!near[i]) continue;
        ++rim;
        EXPECT_LT(std::abs(p[2]), 2.5);
        EXPECT_LT(std::max(std::abs(p[0]), std::abs(p[1])), kOpening / 2 + 1.5);
    }
    EXPECT_GT(rim, 50);
}

TEST(ThinWalls, DoNotDependOnThreads) {
    const Volume volume = plate_scan(0.7, 0.4, 20);
    const Mesh mesh = surface_of(volume);
    const ThinWalls one = find_thin_walls(volume, kIsovalue, mesh, {.noise = 20, .threads = 1});
    const ThinWalls all = find_thin_walls(volume, kIsovalue, mesh, {.noise = 20});
    EXPECT_EQ(one.area, all.area);
    ASSERT_EQ(one.samples.size(), all.samples.size());
    for (std::size_t i = 0; i < one.samples.size(); ++i)
        EXPECT_EQ(one.samples[i].index, all.samples[i].index);
}

// A part of a volume has the same walls where it has the same samples.
TEST(ThinWalls, APartOfAVolumeHasThemAtTheSamePlace) {
    const Volume volume = plate_scan(0.7);
    const VolumeView part = part_of(volume, {2, 1, 3}, {29, 30, 28});
    const ThinWalls whole = find_thin_walls(volume, kIsovalue, surface_of(volume), {.noise = 1});
    const ThinWalls in_part = find_thin_walls(
        part, kIsovalue, extract_isosurface(part, kIsovalue, {.topology = true}), {.noise = 1});
    ASSERT_EQ(whole.samples.size(), in_part.samples.size());
    EXPECT_EQ(whole.walls.front().position, in_part.walls.front().position);
    EXPECT_EQ(whole.samples.front().index[2], in_part.samples.front().index[2] + 3);
}

TEST(ThinWalls, SamplesOfAnyTypeAreRaisedWithinItsRange) {
    const Volume volume = sampled_in_space<std::uint8_t>(around_origin(32), [&](const Vec3d& p) {
        return std::lround((framed_plate(p, 0.7, 0.2) + 1000) / 10);
    });
    const Mesh mesh = extract_isosurface(volume, 245, {.closed = true, .topology = true});
    const ThinWalls walls = find_thin_walls(volume, 245, mesh, {.noise = 1});
    ASSERT_GT(walls.area, 0);
    const Volume kept = restore_thin_walls(volume, 245, walls);
    EXPECT_EQ(manifold_fault(extract_isosurface(kept, 245, {.closed = true, .topology = true})), "");
}

TEST(ThinWalls, RefuseNumbersThatAreNotFinite) {
    const Volume volume = plate_scan(0.7);
    EXPECT_THROW(find_thin_walls(volume, std::nan(""), Mesh()), InputError);
    for (const float x : {std::nanf(""), INFINITY}) {
        Mesh mesh = surface_of(volume);
        mesh.points[5][1] = x;
        EXPECT_THROW(find_thin_walls(volume, kIsovalue, mesh), InputError);
    }
}

TEST(ThinWalls, RefuseANoiseThatIsNoDeviation) {
    const Volume volume = plate_scan(0.7);
    const Mesh mesh = surface_of(volume);
    for (const double noise : {std::nan(""), -1.0, std::numeric_limits<double>::infinity()})
        EXPECT_THROW(find_thin_walls(volume, kIsovalue, mesh, {.noise = noise}), InputError);
}

// Restoring must not raise the samples beside infinite ones without limit.
TEST(ThinWalls, InfiniteSamplesStayAlone) {
    const Volume plate = plate_scan(0.7);
    Volume volume(plate.geometry(), SampleType::float32);
    const auto* const from = plate.samples<std::int16_t>();
    auto* const to = volume.samples<float>();
    const std::int64_t count = volume.geometry().sample_count();
    for (std::int64_t i = 0; i < count; ++i)
        to[i] = i % 97 == 0 ? -std::numeric_limits<float>::infinity() : static_cast<float>(from[i]);
    const ThinWalls walls = find_thin_walls(volume, kIsovalue, surface_of(volume), {.noise = 20});
    ASSERT_GT(walls.samples.size(), 0u);
    const Volume restored = restore_thin_walls(volume, kIsovalue, walls);
    for (std::int64_t i = 0; i < count; ++i)
        EXPECT_LT(restored.samples<float>()[i], std::numeric_limits<float>::infinity());
}

// How high a wall is cannot be told beside padding, which is far below air.
TEST(ThinWalls, HaveNoPaddingBesideThem) {
    Volume volume = plate_scan(0.7, 0);
    const Mesh mesh = surface_of(volume);
    const ThinWalls whole = find_thin_walls(volume, kIsovalue, mesh, {.noise = 20});
    ASSERT_GT(whole.samples.size(), 0u);
    const auto [nx, ny, nz] = volume.geometry().dims;
    const auto middle = whole.samples[whole.samples.size() / 2].index;
    constexpr std::int16_t kPadding = -2000;
    for (std::int64_t z = middle[2] + 2; z < nz; ++z)
        std::fill_n(volume.samples<std::int16_t>() + z * nx * ny, nx * ny, kPadding);
    EXPECT_FALSE(find_thin_walls(volume, kIsovalue, mesh, {.noise = 20}).samples.empty());
    const ThinWallOptions options{.noise = 20, .padding = kPadding};
    EXPECT_TRUE(find_thin_walls(volume, kIsovalue, mesh, options).samples.empty());
}

// In noise, most of the time is spent on following walls.
TEST(ThinWalls, ReportProgressFromTheStartAndCanBeCancelled) {
    Random random(4);
    std::normal_distribution<double> value(0, 1000);
    const Volume noise =
        sampled<std::int16_t>(grid(48, 48, 48), [&](auto, auto, auto) { return std::lround(value(random)); });
    const Mesh mesh = extract_isosurface(noise, 1000);
    std::vector<double> reports;
    const auto report = [&](double done) {
        reports.push_back(done);
        return true;
    };
    const ThinWalls walls =
        find_thin_walls(noise, 1000, mesh, {.noise = 1, .threads = 1, .progress = report});
    ASSERT_GT(walls.samples.size(), 4096u);
    EXPECT_LT(reports.front(), 0.1);
    EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end()));
    EXPECT_EQ(reports.back(), 1);
    const auto slices = std::count_if(reports.begin(), reports.end(), [](double done) { return done < 1; });
    EXPECT_GT(slices, 48 + 3) << "also while walls are followed";
    const auto cancel = [](double done) { return done == 1; };
    EXPECT_THROW(restore_thin_walls(noise, 1000, walls, cancel), Cancelled);
    EXPECT_NO_THROW(restore_thin_walls(noise, 1000, walls, report));
}

TEST(ThinWalls, AnEmptyVolumeHasNone) {
    const Volume volume = plate_scan(0.7);
    VolumeView empty = volume;
    empty.geometry.dims[2] = 0;
    const ThinWalls walls = find_thin_walls(empty, kIsovalue, surface_of(volume));
    EXPECT_TRUE(walls.samples.empty());
    EXPECT_EQ(near_thin_walls(empty, walls, std::vector<Vec3f>(2)), std::vector<bool>(2));
}

TEST(ThinWalls, PointsOutsideTheVolumeAreNotNear) {
    const Volume volume = plate_scan(0.7, 0);
    ThinWalls corner;
    corner.samples.push_back({.index = {31, 31, 31}});
    const Vec3f last = to_float(volume.geometry().physical({31, 31, 31}));
    const std::vector<Vec3f> points = {last, {last[0] + 1000, last[1], last[2]}, {last[0], NAN, last[2]}};
    EXPECT_EQ(near_thin_walls(volume, corner, points), (std::vector<bool>{true, false, false}));
}

}  // namespace
}  // namespace marrow::test
