#include <gtest/gtest.h>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/refine.h>

#include "fields.h"
#include "mesh_checks.h"

namespace marrow::test {
namespace {

Mesh balls(double first_radius, double second_radius) {
    const auto first = sphere({10, 10, 10}, first_radius), second = sphere({30, 10, 10}, second_radius);
    const Volume volume = sampled_in_space<float>(
        grid(41, 21, 21), [&](const Vec3d& p) { return std::max(first(p), second(p)); });
    return extract_isosurface(volume, 0);
}

TEST(LargestComponent, KeepsTheLargerBallUnchanged) {
    const Mesh both = balls(5, 7);
    ASSERT_EQ(measure(both).components, 2);
    const Mesh larger = largest_component(both);
    EXPECT_EQ(manifold_fault(larger), "");
    const Mesh alone = balls(-10, 7);  // a ball of negative radius has no surface
    EXPECT_TRUE(larger.points == alone.points);
    EXPECT_TRUE(larger.normals == alone.normals);
    EXPECT_TRUE(larger.triangles == alone.triangles);
}

TEST(LargestComponent, OfEqualsIsTheFirst) {
    Mesh mesh;
    mesh.points = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
    mesh.triangles = {{4, 5, 6}, {1, 2, 3}};
    const Mesh first = largest_component(mesh);
    EXPECT_TRUE(first.points == (Buffer<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_TRUE(first.triangles == (Buffer<Triangle>{{0, 1, 2}}));
}

TEST(LargestComponent, OfNothingIsNothing) {
    EXPECT_TRUE(largest_component({}).points.empty());
    Mesh unused;
    unused.points = {{0, 0, 0}};
    EXPECT_TRUE(largest_component(unused).points.empty());
}

}  // namespace
}  // namespace marrow::test
