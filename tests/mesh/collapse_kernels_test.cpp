// Tests what edge collapse computes with vectors: shared neighbours, shapes of triangles, and targets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "mesh/reduction/collapse_ring.h"
#include "mesh/reduction/collapse_target.h"

namespace marrow::test {
namespace {

using namespace internal;

TEST(CollapseRing, CountsThePointsThatBothHave) {
    std::mt19937 random(1);
    for (int trial = 0; trial < 2000; ++trial) {
        std::vector<std::uint32_t> numbers(48);
        for (std::uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
        const auto ring_of_some = [&] {
            Ring ring;
            std::shuffle(numbers.begin(), numbers.end(), random);
            ring.size = 1 + random() % Ring::kMost;
            // What follows the ring must not count.
            for (std::size_t k = 0; k < Ring::kCapacity; ++k) ring.points[k] = numbers[k];
            return ring;
        };
        const Ring a = ring_of_some(), b = ring_of_some();
        const auto expected = std::count_if(a.points, a.points + a.size, [&](std::uint32_t p) {
            return std::find(b.points, b.points + b.size, p) != b.points + b.size;
        });
        ASSERT_EQ(count_shared(a, b), static_cast<std::size_t>(expected)) << trial;
    }
}

// A regular polygon around the origin.
Ring polygon(std::size_t size) {
    Ring ring;
    ring.size = size;
    for (std::size_t k = 0; k <= size; ++k) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(k % size) / static_cast<double>(size);
        ring.set(k, static_cast<std::uint32_t>(k % size),
                 to_float(Vec3d{std::cos(angle), std::sin(angle), 0}));
    }
    return ring;
}

TEST(CollapseRing, NoticesEachTriangleThatFlipsExceptForTheFirstAndTheLast) {
    for (std::size_t size = 3; size <= 20; ++size) {
        const Ring ring = polygon(size);
        EXPECT_TRUE(keeps_shape(ring, {}, {0.01, -0.01, 0})) << size;
        for (std::size_t flipped = 0; flipped < size; ++flipped) {
            // Just beyond the middle of this triangle's outer edge: only this triangle turns over.
            const double angle =
                2 * std::numbers::pi * (static_cast<double>(flipped) + 0.5) / static_cast<double>(size);
            const double to_edge = std::cos(std::numbers::pi / static_cast<double>(size));
            const double there = 1e-3 + to_edge;
            const bool vanishes = flipped == 0 || flipped == size - 1;
            EXPECT_EQ(keeps_shape(ring, {}, {there * std::cos(angle), there * std::sin(angle), 0}), vanishes)
                << flipped << " of " << size;
        }
    }
}

Quadric<float> planes(std::initializer_list<Vec3d> normals) {
    Quadric<float> sum;
    for (const Vec3d& n : normals) sum.add_plane(n, 1);
    return sum;
}

TEST(CollapseTarget, IsWherePlanesMeetAndDoesNotDependOnOtherEdges) {
    // The first point is on the planes x = 1 and y = 2, the second one on z = 3.
    const Vec3f from{1, 2, 2.5f}, to{1.2f, 2.1f, 3};
    const Quadric<float> of_from = planes({{1, 0, 0}, {0, 1, 0}}), of_to = planes({{0, 0, 1}});
    CollapseBatch alone;
    alone.add(from, of_from, to, of_to);
    alone.evaluate();
    const Vec3f corner{1, 2, 3};
    for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(alone[0].position[axis], corner[axis], 1e-3) << axis;
    EXPECT_NEAR(alone[0].sum, 0, 1e-6);
    EXPECT_NEAR(alone[0].weight, 3, 1e-6);

    std::mt19937 random(2);
    std::uniform_real_distribution<float> any(-1, 1);
    for (std::size_t place = 0; place < CollapseBatch::kMost; ++place) {
        CollapseBatch batch;
        for (std::size_t i = 0; i < place; ++i)
            batch.add({any(random), any(random), any(random)}, of_to, {any(random), 0, 0}, of_from);
        batch.add(from, of_from, to, of_to);
        batch.evaluate();
        EXPECT_EQ(batch[place].position, alone[0].position);
        EXPECT_EQ(batch[place].cost, alone[0].cost);
        EXPECT_EQ(batch[place].sum, alone[0].sum);
    }
}

TEST(CollapseTarget, IsTheMiddleOfAnEdgeInAPlane) {
    CollapseBatch batch;
    const Quadric<float> plane = planes({{0, 0, 1}});
    batch.add({0, 0, 5}, plane, {1, 2, 5}, plane);
    batch.evaluate();
    EXPECT_EQ(batch[0].position, (Vec3f{0.5f, 1, 5}));
    EXPECT_EQ(batch[0].sum, 0);
}

}  // namespace
}  // namespace marrow::test
