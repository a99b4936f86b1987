// The bands of the points of a mesh, and the triangles around them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "mesh/connectivity/point_bands.h"
#include "support/fields.h"

namespace marrow::test {
namespace {

using internal::PointBands;

struct Order {
    const char* name;
    std::uint32_t reach;  // between the corners of a triangle
    bool shuffled;
    friend void PrintTo(const Order& order, std::ostream* out) { *out << order.name; }
};

class EveryOrder : public testing::TestWithParam<Order> {};

INSTANTIATE_TEST_SUITE_P(, EveryOrder,
                         testing::Values(Order{"near", 50, false}, Order{"across_bands", 40000, false},
                                         Order{"shuffled", 50, true}),
                         [](const auto& info) { return std::string(info.param.name); });

// Some points, the last ones among them, have no triangle.
Mesh triangles_of(const Order& order) {
    constexpr std::uint32_t kPoints = 200'001, kTriangles = 300'000;
    Random random(5);
    Mesh mesh;
    mesh.points.resize(kPoints, Vec3f{});
    mesh.triangles.resize(kTriangles);
    for (std::uint32_t t = 0; t < kTriangles; ++t) {
        const auto near = static_cast<std::uint32_t>(std::uint64_t{t} * (kPoints - order.reach) / kTriangles);
        for (std::uint32_t& p : mesh.triangles[t])
            p = near + static_cast<std::uint32_t>(random() % order.reach);
    }
    if (order.shuffled) std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    return mesh;
}

TEST_P(EveryOrder, BandsHaveAllPointsAndTheTrianglesAroundThem) {
    const Mesh mesh = triangles_of(GetParam());
    for (const int threads : {1, 2, 3}) {
        internal::with_threads(threads, [&] {
            const PointBands bands(mesh);
            // Bands of triangles without order are as many as threads.
            EXPECT_EQ(bands.size(),
                      GetParam().shuffled ? static_cast<std::size_t>(internal::thread_count()) : 7u);
            std::vector<PointBands::Band> all(bands.size());
            bands.for_each([&](const PointBands::Band& band) { all[band.index] = band; });
            std::size_t points = 0;
            for (const PointBands::Band& band : all) {
                EXPECT_EQ(band.begin, points);
                EXPECT_GT(band.end, band.begin);
                EXPECT_LE(band.size(), bands.width());
                EXPECT_EQ(band.begin % PointBands::kChunk, 0u);
                points = band.end;
            }
            EXPECT_EQ(points, mesh.points.size());

            for (const PointBands::Band& band : all) {
                std::vector<std::size_t> expected, forward, backward;
                for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                    const Triangle& corners = mesh.triangles[t];
                    if (std::any_of(corners.begin(), corners.end(),
                                    [&](std::uint32_t p) { return p >= band.begin && p < band.end; }))
                        expected.push_back(t);
                }
                const auto list_in = [&](std::vector<std::size_t>& list) {
                    return [&](std::size_t t, const auto& is_inside) {
                        bool any = false;
                        for (const std::uint32_t p : mesh.triangles[t]) {
                            ASSERT_EQ(is_inside(p), p >= band.begin && p < band.end);
                            any |= is_inside(p);
                        }
                        if (any) list.push_back(t);
                    };
                };
                bands.for_each_triangle(band, list_in(forward));
                bands.for_each_triangle_backward(band, list_in(backward));
                EXPECT_EQ(forward, expected);
                std::reverse(backward.begin(), backward.end());
                EXPECT_EQ(backward, expected);
            }
        });
    }
}

TEST(PointBands, AMeshWithoutPointsHasNone) {
    const Mesh empty;
    EXPECT_EQ(PointBands(empty).size(), 0u);
}

}  // namespace
}  // namespace marrow::test
