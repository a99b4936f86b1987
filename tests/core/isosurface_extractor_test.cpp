// An extractor makes the same meshes as extract_isosurface, whatever it extracted before.
#include <gtest/gtest.h>

#include <marrow/isosurface.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

// Smooth samples with noise, with NaN if the type has it, in rows that are not a multiple of a word.
template <class T>
Volume scan(Random& random) {
    std::normal_distribution<double> noise(0, 4);
    return sampled<T>(grid(150, 43, 29), [&](auto x, auto y, auto z) {
        if (std::is_floating_point_v<T> && random() % 1000 == 0)
            return std::numeric_limits<double>::quiet_NaN();
        const double r = std::hypot(static_cast<double>(x) - 75, 2.0 * static_cast<double>(y) - 43,
                                    3.0 * static_cast<double>(z) - 43);
        return std::clamp(120 - 1.7 * r + noise(random), 0.0, 127.0);
    });
}

std::vector<Volume> scans() {
    Random random(5);
    std::vector<Volume> volumes;
    volumes.push_back(scan<std::uint8_t>(random));
    volumes.push_back(scan<std::int8_t>(random));
    volumes.push_back(scan<std::uint16_t>(random));
    volumes.push_back(scan<std::int16_t>(random));
    volumes.push_back(scan<std::int32_t>(random));
    volumes.push_back(scan<float>(random));
    volumes.push_back(scan<double>(random));
    return volumes;
}

TEST(Extractor, FiftyIsovaluesInAnyOrderGiveTheSameMeshes) {
    Random random(6);
    for (const Volume& volume : scans()) {
        for (const bool closed : {false, true}) {
            const IsosurfaceOptions options{.closed = closed, .topology = closed};
            IsosurfaceExtractor extractor(volume, options);
            double isovalue = 60;
            for (int i = 0; i < 50; ++i) {
                // Small steps as from a slider, jumps, values of samples, and values beyond all samples.
                switch (random() % 5) {
                    case 0:
                        isovalue = static_cast<double>(random() % 128);
                        break;
                    case 1:
                        isovalue = static_cast<double>(random() % 200) * 1.37 - 60;
                        break;
                    default:
                        isovalue *= 1.03;
                }
                IsosurfaceStats one_off, cached;
                const Mesh fresh = extract_isosurface(volume, isovalue, options, &one_off);
                const Mesh& again = extractor.extract(isovalue, 0, &cached);
                ASSERT_EQ(mesh_hash(again), mesh_hash(fresh))
                    << sample_type_name(volume.type()) << ' ' << isovalue;
                ASSERT_EQ(cached.non_finite_samples, one_off.non_finite_samples);
            }
        }
    }
}

// The largest int32 is below 2^31, the float that bounds its block.
TEST(Extractor, NothingIsInsideAboveTheLargestSample) {
    const Volume volume = sampled<std::int32_t>(grid(3, 3, 3), [](auto x, auto y, auto z) {
        return x == 1 && y == 1 && z == 1 ? std::numeric_limits<std::int32_t>::max() : 0;
    });
    IsosurfaceExtractor extractor(volume);
    for (const double isovalue : {1.0, 2147483647.0, 2147483647.5, 2147483648.0, 5e9, 2147483647.0}) {
        EXPECT_EQ(mesh_hash(extractor.extract(isovalue)), mesh_hash(extract_isosurface(volume, isovalue)))
            << isovalue;
    }
}

TEST(Extractor, PreviewIsTheSurfaceOfEveryNthSample) {
    Random random(7);
    const Volume volume = scan<std::int16_t>(random);
    IsosurfaceExtractor extractor(volume);
    for (const int level : {1, 2, 3}) {
        const std::int64_t step = 1 << level;
        Geometry g = volume.geometry();
        for (std::size_t a = 0; a < 3; ++a) {
            g.dims[a] = (g.dims[a] + step - 1) / step;
            g.spacing[a] *= static_cast<double>(step);
        }
        const Volume coarse = sampled<std::int16_t>(g, [&](auto x, auto y, auto z) {
            return volume.samples<std::int16_t>()[((z * 43 + y) * 150 + x) * step];
        });
        for (const double isovalue : {60.0, 61.5}) {
            EXPECT_EQ(mesh_hash(extractor.extract(isovalue, level)),
                      mesh_hash(extract_isosurface(coarse, isovalue)));
        }
    }
    EXPECT_EQ(mesh_hash(extractor.extract(60)), mesh_hash(extract_isosurface(volume, 60)));
}

TEST(Extractor, FillsTheMeshOfTheCallerAndReusesItsMemory) {
    Random random(9);
    const Volume volume = scan<std::int16_t>(random);
    IsosurfaceExtractor extractor(volume, {.threads = 1});
    Mesh mesh, other;
    extractor.extract(60, mesh);
    const Vec3f* const points = mesh.points.data();
    const std::size_t capacity = mesh.points.capacity();
    extractor.extract(61, other);
    EXPECT_EQ(mesh_hash(mesh), mesh_hash(extract_isosurface(volume, 60)));
    EXPECT_EQ(mesh_hash(other), mesh_hash(extract_isosurface(volume, 61)));
    extractor.extract(60.5, mesh, 1);  // a preview is smaller
    EXPECT_EQ(mesh_hash(mesh), mesh_hash(extractor.extract(60.5, 1)));
    EXPECT_EQ(mesh.points.data(), points);
    EXPECT_EQ(mesh.points.capacity(), capacity);
    extractor.extract(1e6, mesh);
    EXPECT_TRUE(mesh.points.empty() && mesh.normals.empty() && mesh.triangles.empty());
}

TEST(Extractor, WorksAfterCancelling) {
    Random random(8);
    const Volume volume = scan<float>(random);
    constexpr int kNever = 1 << 30;
    int calls = 0, last = kNever;
    IsosurfaceExtractor extractor(volume, {.progress = [&](double) { return ++calls < last; }});
    extractor.extract(52);
    calls = 0;
    extractor.extract(70);
    const int all = calls;  // more of them on more threads
    extractor.extract(52);
    for (const int call : {1, 5, 20, 35, 60, all - 1, all}) {
        calls = 0;
        last = call;
        EXPECT_THROW(extractor.extract(70), Cancelled) << call << " of " << all;
        last = kNever;
        EXPECT_EQ(mesh_hash(extractor.extract(52)), mesh_hash(extract_isosurface(volume, 52)));
    }
}

TEST(Extractor, EmptyVolumesAndBadArguments) {
    const Volume empty(grid(0, 4, 4), SampleType::uint8);
    EXPECT_TRUE(IsosurfaceExtractor(empty).extract(1).points.empty());
    const Volume volume = checkerboard(4);
    IsosurfaceExtractor extractor(volume);
    EXPECT_THROW(extractor.extract(std::nan("")), InputError);
    EXPECT_THROW(extractor.extract(0.5, -1), InputError);
    EXPECT_TRUE(extractor.extract(0.5, 2).points.empty());  // one sample is left
}

}  // namespace
}  // namespace marrow::test
