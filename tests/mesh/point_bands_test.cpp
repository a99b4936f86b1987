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

constexpr std::size_t kBandsOfOrderedTriangles = 7;  // of 32768 points

class EveryOrder : public testing::TestWithParam<Order> {};

INSTANTIATE_TEST_SUITE_P(, EveryOrder,
                         testing::Values(Order{"near", 50, false}, Order{"across_bands", 40000, false},
                                         Order{"shuffled", 50, true}),
                         [](const auto& info) { return std::string(info.param.name); });

// Each band has the triangles with corners there, in both orders.
void expect_triangles_around_bands(const Mesh& mesh, const PointBands& bands) {
    bands.for_each([&](const PointBands::Band& band) {
        const auto is_expected = [&](std::uint32_t p) { return p >= band.begin && p < band.end; };
        std::vector<std::size_t> expected, forward, backward;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            if (std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), is_expected))
                expected.push_back(t);
        }
        bool agrees = true;
        const auto list_in = [&](std::vector<std::size_t>& list) {
            return [&](std::size_t t, const auto& is_inside) {
                bool any = false;
                for (const std::uint32_t p : mesh.triangles[t]) {
                    agrees &= is_inside(p) == is_expected(p);
                    any |= is_expected(p);
                }
                if (any) list.push_back(t);
            };
        };
        bands.for_each_triangle(band, list_in(forward));
        bands.for_each_triangle_backward(band, list_in(backward));
        std::reverse(backward.begin(), backward.end());
        EXPECT_TRUE(agrees) << band.index;
        EXPECT_EQ(forward, expected) << band.index;
        EXPECT_EQ(backward, expected) << band.index;
    });
}

// Some points, the last one among them, have no triangle.
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
            // Where triangles have no order, there are as many bands as threads.
            EXPECT_EQ(bands.size(), GetParam().shuffled ? static_cast<std::size_t>(internal::thread_count())
                                                        : kBandsOfOrderedTriangles);
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
            expect_triangles_around_bands(mesh, bands);
        });
    }
}

// The first and the last point of a band are the last and the first ones that sections reach.
TEST(PointBands, SectionsMayEndAtTheirBorders) {
    constexpr std::uint32_t kBand = 64 * PointBands::kChunk, kSection = 8192;
    Mesh mesh;
    mesh.points.resize(8 * kBand, Vec3f{});
    const auto add_section = [&](std::uint32_t lowest, std::uint32_t highest) {
        for (std::uint32_t t = 0; t + 1 < kSection; ++t)
            mesh.triangles.push_back({lowest + t % 2, lowest + 2 + t % 3, lowest + 5 + t % 7});
        mesh.triangles.push_back({lowest, lowest + 1, highest});
    };
    for (std::uint32_t band = 1; band < 6; ++band) {
        const std::uint32_t first = band * kBand, end = first + kBand;
        add_section(first, end - 1);
        add_section(first, end);
        add_section(first - 20, first);
        add_section(end - 1, end + 20);
        add_section(first - 20, first - 1);
    }
    internal::with_threads(1, [&] {
        const PointBands bands(mesh);
        ASSERT_EQ(bands.width(), kBand);
        expect_triangles_around_bands(mesh, bands);
    });
}

TEST(PointBands, AMeshWithoutPointsHasNone) {
    const Mesh empty;
    EXPECT_EQ(PointBands(empty).size(), 0u);
}

}  // namespace
}  // namespace marrow::test
