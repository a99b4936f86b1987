// Normals that agree with the triangles around their points.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include <marrow/normals.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>
#include <marrow/volume_filters.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

Volume noise() {
    Random random(54);
    return sampled<std::int16_t>(grid(30, 30, 30),
                                 [&](auto, auto, auto) { return static_cast<int>(random() % 2001) - 1000; });
}

Mesh noise_surface() {
    const Volume volume = noise();
    return extract_isosurface(volume, 100.5, {.closed = true});
}

// The normals without a positive product with the mean of their faces, each counted once or by its area.
std::size_t normals_against_faces(const Mesh& mesh) {
    std::vector<Vec3d> units(mesh.points.size(), Vec3d{}), areas = units;
    for (const Triangle& t : mesh.triangles) {
        const Vec3d a = to_double(mesh.points[t[0]]);
        const Vec3d normal = cross(to_double(mesh.points[t[1]]) - a, to_double(mesh.points[t[2]]) - a);
        if (length(normal) == 0) continue;
        for (const std::uint32_t p : t) {
            units[p] = units[p] + (1 / length(normal)) * normal;
            areas[p] = areas[p] + normal;
        }
    }
    std::size_t against = 0;
    for (std::size_t p = 0; p < units.size(); ++p) {
        const Vec3d normal = to_double(mesh.normals[p]);
        EXPECT_NEAR(length(normal), 1, 1e-6) << p;
        against += !(dot(normal, units[p]) > 0 && dot(normal, areas[p]) > 0);
    }
    return against;
}

TEST(Normals, TurnOutwardWhereTheyPointAgainstTheirFaces) {
    Mesh mesh = noise_surface();
    const std::size_t against = normals_against_faces(mesh);
    ASSERT_GT(against, 0u);
    Mesh alone = mesh;
    EXPECT_EQ(turn_normals_outward(mesh), against);
    EXPECT_EQ(normals_against_faces(mesh), 0u);
    EXPECT_EQ(turn_normals_outward(mesh), 0u);
    turn_normals_outward(alone, 1);
    EXPECT_TRUE(std::equal(alone.normals.begin(), alone.normals.end(), mesh.normals.begin()));
    mesh.normals = {};
    EXPECT_EQ(turn_normals_outward(mesh), 0u);
    EXPECT_TRUE(mesh.normals.empty());
}

TEST(Normals, PointOutwardAfterSmoothingAndReduction) {
    const Mesh mesh = noise_surface();
    EXPECT_EQ(normals_against_faces(smooth(mesh, {.iterations = 10})), 0u);
    const auto half = static_cast<std::int64_t>(mesh.triangles.size() / 2);
    EXPECT_EQ(normals_against_faces(simplify(mesh, {.triangles = half})), 0u);
}

// The faces of points that two slabs share are in both.
TEST(Normals, AreTheSameInSlabs) {
    const Volume volume = noise();
    for (const bool closed : {false, true}) {
        const IsosurfaceOptions options{.closed = closed};
        Mesh whole = extract_isosurface(volume, 100.5, options);
        turn_normals_outward(whole);
        const SliceSource source{volume.geometry(), volume.type(), [&](auto begin, auto end, void* samples) {
                                     const Volume slices = crop(volume, {0, 0, begin}, {29, 29, end - 1});
                                     std::memcpy(samples, slices.data(), slices.bytes());
                                 }};
        for (const std::int64_t slices : {1, 7, 30}) {
            Buffer<Vec3f> normals(whole.points.size());
            OutwardNormals outward;
            const SurfaceSink sink{[](auto, auto, auto) {},
                                   [&](const SurfacePart& part) {
                                       std::copy(
                                           part.normals.begin(), part.normals.end(),
                                           normals.begin() + static_cast<std::ptrdiff_t>(part.first_point));
                                       for (const auto& [point, normal] : outward.add(part))
                                           normals[point] = normal;
                                   }};
            extract_isosurface_in_slabs(source, 100.5, sink, {.slices = slices}, options);
            EXPECT_TRUE(std::equal(normals.begin(), normals.end(), whole.normals.begin())) << slices;
        }
    }
}

}  // namespace
}  // namespace marrow::test
