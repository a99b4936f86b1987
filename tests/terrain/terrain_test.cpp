// extract_terrain: exact at the samples, closed if requested, independent of the blocks.
#include <gtest/gtest.h>

#include <cpl_conv.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/terrain.h>

#include "support/fields.h"
#include "support/mesh_checks.h"
#include "support/temporary_folder.h"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A GeoTIFF of height(column from the west, row from the south), by default in UTM 33 N, with pixels of
/// `cell` metres, or `cell` from west to east and `cell_north` from south to north.
struct RasterFile {
    int columns = 0, rows = 0;
    double cell = 10;
    std::optional<double> cell_north = {};
    int epsg = 32633;       ///< 0: no coordinate system
    int vertical_epsg = 0;  ///< 0: no vertical coordinate system
    double west = 500000, north = 5000000;
    std::string unit = {};
    bool placed = true;
    bool south_up = false;

    fs::path write(const fs::path& path, const std::function<double(int, int)>& height) const {
        GDALAllRegister();
        GDALDatasetH file =
            GDALCreate(GDALGetDriverByName("GTiff"), path.c_str(), columns, rows, 1, GDT_Float64, nullptr);
        const double step_north = cell_north.value_or(cell);
        double transform[6] = {west, cell, 0, north, 0, -step_north};
        if (south_up) transform[3] = north - rows * step_north, transform[5] = step_north;
        if (placed) GDALSetGeoTransform(file, transform);
        if (epsg != 0) {
            OGRSpatialReferenceH reference = OSRNewSpatialReference(nullptr);
            const std::string vertical = vertical_epsg != 0 ? "+" + std::to_string(vertical_epsg) : "";
            EXPECT_EQ(OSRSetFromUserInput(reference, ("EPSG:" + std::to_string(epsg) + vertical).c_str()),
                      OGRERR_NONE);
            GDALSetSpatialRef(file, reference);
            OSRRelease(reference);
        }
        GDALRasterBandH band = GDALGetRasterBand(file, 1);
        GDALSetRasterNoDataValue(band, -9999);
        if (!unit.empty()) GDALSetRasterUnitType(band, unit.c_str());
        std::vector<double> line(static_cast<std::size_t>(columns));
        for (int row = 0; row < rows; ++row) {
            const int from_south = south_up ? row : rows - 1 - row;
            for (int column = 0; column < columns; ++column) {
                const double h = height(column, from_south);
                line[static_cast<std::size_t>(column)] = std::isnan(h) ? -9999 : h;
            }
            EXPECT_EQ(
                GDALRasterIO(band, GF_Write, 0, row, columns, 1, line.data(), columns, 1, GDT_Float64, 0, 0),
                CE_None);
        }
        GDALClose(file);
        return path;
    }
};

double hills(int i, int j) {
    return 300 + 40 * std::sin(0.11 * i) * std::cos(0.07 * j) + 15 * std::sin(0.23 * (i + j));
}

double flat(int, int) {
    return 7;
}

// Rough ground: noise up to several samples high, with flat areas and heights at multiples of a step.
double rough(int i, int j) {
    const auto h = static_cast<std::uint32_t>(i) * 73856093u ^ static_cast<std::uint32_t>(j) * 19349663u;
    if ((i / 9 + j / 7) % 3 == 0) return 20 * static_cast<double>((i / 9 + j / 7) % 5);
    return static_cast<double>((h * 2654435761u >> 16) % 61);
}

double rough_with_holes(int i, int j) {
    const bool hole = (i * 7 + j * 13) % 23 == 0 || (i > 60 && i < 68 && j > 61 && j < 66) ||
                      (i == 0 && j < 5) || (i % 11 == 3 && j % 5 == 1);
    return hole ? kUnknown : rough(i, j);
}

// Where the density is zero on the edge of a point. extract_isosurface keeps points 1/1024 of an edge, here
// 9.8 mm, away from samples, but terrain goes through them. \pre the direction is the identity
Vec3f exact_crossing(const Volume& density, const Vec3f& point) {
    const Geometry& g = density.geometry();
    std::array<std::int64_t, 3> first{};
    std::size_t axis = 0;
    double furthest = -1;
    for (std::size_t a = 0; a < 3; ++a) {
        const double index = (static_cast<double>(point[a]) - g.origin[a]) / g.spacing[a];
        const double off = std::abs(index - std::round(index));
        first[a] = std::llround(index);
        if (off <= furthest) continue;
        furthest = off;
        axis = a;
    }
    first[axis] = static_cast<std::int64_t>(
        std::floor((static_cast<double>(point[axis]) - g.origin[axis]) / g.spacing[axis]));
    std::array<std::int64_t, 3> second = first;
    ++second[axis];
    const auto at = [&](const std::array<std::int64_t, 3>& i) {
        return density.samples<double>()[(i[2] * g.dims[1] + i[1]) * g.dims[0] + i[0]];
    };
    Vec3d index{static_cast<double>(first[0]), static_cast<double>(first[1]), static_cast<double>(first[2])};
    index[axis] += at(first) / (at(first) - at(second));
    return to_float(g.physical(index));
}

TEST(Terrain, BlocksGiveTheSurfaceOfOneVolume) {
    const test::TemporaryFolder folder;
    constexpr int kColumns = 150, kRows = 139;  // three by three blocks
    const auto height = [](int i, int j) { return hills(i, j) + 0.37 * rough(i, j); };
    const fs::path file = RasterFile{kColumns, kRows}.write(folder / "dem.tif", height);
    TerrainInfo info;
    const Mesh terrain = extract_terrain(file, {}, &info);
    EXPECT_EQ(test::manifold_fault(terrain, true), "");

    // The whole ground as one density volume, in mm, centred on the raster.
    Geometry g;
    const double lowest = 200, highest = 420;
    g.dims = {kColumns, kRows, static_cast<std::int64_t>((highest - lowest) / 10)};
    g.spacing = {10e3, 10e3, 10e3};
    const double shift = info.lowest - 0.381966 * 10;  // the same layers as in the terrain
    const double first_layer = shift - 10 * std::ceil((shift - lowest) / 10);
    g.origin = {-(kColumns - 1) * 5e3, -(kRows - 1) * 5e3, first_layer * 1e3};
    const Volume density = test::sampled<double>(g, [&](auto i, auto j, auto k) {
        return height(static_cast<int>(i), static_cast<int>(j)) -
               (first_layer + 10.0 * static_cast<double>(k));
    });
    Mesh whole = extract_isosurface(density, 0, {.normals = false});
    for (Vec3f& p : whole.points) p = exact_crossing(density, p);
    EXPECT_EQ(terrain.points.size(), whole.points.size());
    EXPECT_EQ(terrain.triangles.size(), whole.triangles.size());
    EXPECT_EQ(measure(terrain).boundary_edges, measure(whole).boundary_edges);
    EXPECT_LT(mesh_distance(terrain, whole, {.samples = 20'000}).max, 1) << "mm, where a sample is 10 m";
}

TEST(Terrain, GoesThroughEverySample) {
    const test::TemporaryFolder folder;
    const fs::path file = RasterFile{90, 70}.write(folder / "dem.tif", hills);
    TerrainInfo info;
    const Mesh mesh = extract_terrain(file, {}, &info);
    EXPECT_LT(info.max_error, 1e-3);
    EXPECT_EQ(info.centre, (std::array<double, 2>{500450, 4999650}));
    std::size_t found = 0;
    for (const Vec3f& p : mesh.points) {
        const double i = p[0] / 10e3 + 89 / 2.0, j = p[1] / 10e3 + 69 / 2.0;
        if (std::abs(i - std::round(i)) > 1e-6 || std::abs(j - std::round(j)) > 1e-6) continue;
        EXPECT_NEAR(p[2] / 1e3, hills(static_cast<int>(std::round(i)), static_cast<int>(std::round(j))),
                    1e-3);
        ++found;
    }
    EXPECT_EQ(found, 90u * 70u) << "each sample once";
}

TEST(Terrain, OfAPlaneIsAPlane) {
    const test::TemporaryFolder folder;
    const auto plane = [](int i, int j) { return 100 + 3.25 * i - 1.5 * j; };
    const fs::path file = RasterFile{130, 70}.write(folder / "dem.tif", plane);
    const Mesh mesh = extract_terrain(file);
    for (const Vec3f& p : mesh.points) {
        const double i = p[0] / 10e3 + 129 / 2.0, j = p[1] / 10e3 + 69 / 2.0;
        EXPECT_NEAR(p[2] / 1e3, 100 + 3.25 * i - 1.5 * j, 1e-3);
    }
    const double slope = std::sqrt(1 + 0.325 * 0.325 + 0.15 * 0.15);
    EXPECT_NEAR(measure(mesh).area / (1290e3 * 690e3 * slope), 1, 1e-6);
}

TEST(Terrain, OfAPlaneIsAPlaneIfItsSamplesBecomeFewerAlongOneAxisOnly) {
    const test::TemporaryFolder folder;
    RasterFile raster{100, 10};
    raster.cell_north = 100;
    const fs::path file = raster.write(folder / "dem.tif", [](int, int j) { return 50.0 * j; });
    for (const double cell : {9, 15, 20, 30, 50, 99}) {
        const Mesh mesh = extract_terrain(file, {.cell = cell});
        double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
        for (const Vec3f& p : mesh.points) {
            if (std::abs(p[1]) > 300e3) continue;  // the plane ends in the samples at the border
            const double above = p[2] / 1e3 - p[1] / 2e3;
            lowest = std::min(lowest, above);
            highest = std::max(highest, above);
        }
        EXPECT_NEAR(lowest, highest, 1e-2) << "cell " << cell;
    }
}

struct Ground {
    const char* name;
    double (*height)(int, int);
};

void PrintTo(const Ground& ground, std::ostream* out) {
    *out << ground.name;
}

class ClosedTerrain : public testing::TestWithParam<Ground> {};
INSTANTIATE_TEST_SUITE_P(Of, ClosedTerrain,
                         testing::Values(Ground{"hills", hills}, Ground{"rough", rough},
                                         Ground{"rough with holes", rough_with_holes}, Ground{"flat", flat}));

TEST_P(ClosedTerrain, IsAClosedManifold) {
    const test::TemporaryFolder folder;
    for (const auto& [columns, rows] : {std::pair{2, 2}, {3, 9}, {64, 65}, {66, 63}, {131, 70}}) {
        const fs::path file = RasterFile{columns, rows}.write(folder / "dem.tif", GetParam().height);
        for (const std::optional<double>& cell : {std::optional<double>(), std::optional(4.0)}) {
            const Mesh block = extract_terrain(file, {.cell = cell, .base = 2, .size = 100});
            EXPECT_EQ(test::manifold_fault(block), "")
                << columns << " x " << rows << ", cell " << cell.value_or(0);
            EXPECT_GT(measure(block).volume, 0);
        }
        const Mesh open = extract_terrain(file);
        EXPECT_EQ(test::manifold_fault(open, true), "") << columns << " x " << rows;
    }
}

TEST(TerrainBlock, HasTheRequestedSizeBaseAndVolume) {
    const test::TemporaryFolder folder;
    // 100 m below the highest corner on 1290 m: a wedge, whose volume is known.
    const fs::path file =
        RasterFile{130, 70}.write(folder / "dem.tif", [](int i, int) { return 50 + 100.0 * i / 129; });
    TerrainInfo info;
    const Mesh block = extract_terrain(file, {.exaggerate = 2, .base = 5, .size = 258}, &info);
    EXPECT_NEAR(info.mm_per_metre, 0.2, 1e-12);
    const MeshMeasures m = measure(block);
    EXPECT_NEAR(m.lower[0], -129, 1e-4);
    EXPECT_NEAR(m.upper[0], 129, 1e-4);
    EXPECT_NEAR(m.lower[1], -69, 1e-4);
    EXPECT_NEAR(m.upper[1], 69, 1e-4);
    EXPECT_EQ(m.lower[2], 0);
    EXPECT_NEAR(m.upper[2], 5 + 2 * 100 * 0.2, 1e-4);
    EXPECT_NEAR(m.volume / (258 * 138 * (5 + 20)), 1, 1e-5);
    EXPECT_EQ(m.components, 1);
    EXPECT_EQ(m.euler_characteristic, 2);
}

TEST(TerrainBlock, OfOneHoleIsARing) {
    const test::TemporaryFolder folder;
    const fs::path file = RasterFile{20, 20}.write(folder / "dem.tif", [](int i, int j) {
        return i > 6 && i < 12 && j > 8 && j < 13 ? kUnknown : hills(i, j);
    });
    TerrainInfo info;
    const MeshMeasures block = measure(extract_terrain(file, {.base = 3, .size = 50}, &info));
    EXPECT_EQ(info.unknown_samples, 20);
    EXPECT_EQ(block.boundary_edges, 0);
    EXPECT_EQ(block.euler_characteristic, 0) << "a torus";
    const MeshMeasures open = measure(extract_terrain(file));
    EXPECT_EQ(open.euler_characteristic, 0) << "an annulus";
    EXPECT_GT(open.boundary_edges, 0);
}

TEST(Terrain, OfSmoothGroundKeepsItsHeightsAtACoarserCell) {
    const test::TemporaryFolder folder;
    const fs::path file = RasterFile{200, 160}.write(folder / "dem.tif", hills);
    TerrainInfo fine, coarse;
    const Mesh all = extract_terrain(file, {}, &fine);
    const Mesh half = extract_terrain(file, {.cell = 20}, &coarse);
    EXPECT_EQ(coarse.samples, (std::array<std::int64_t, 2>{100, 80}));
    EXPECT_EQ(coarse.cell, (std::array<double, 3>{20, 20, 20}));
    EXPECT_GT(coarse.rms_error, 0.01);
    EXPECT_LE(coarse.rms_error, 0.1 * coarse.cell[2]);
    EXPECT_NEAR(static_cast<double>(half.triangles.size()) / static_cast<double>(all.triangles.size()), 0.25,
                0.03);
    TerrainInfo jagged;
    extract_terrain(RasterFile{200, 160}.write(folder / "rough.tif", rough), {.cell = 20}, &jagged);
    EXPECT_GT(jagged.rms_error, 0.1 * jagged.cell[2]) << "and says so where it cannot";
}

TEST(Terrain, LevelsOfDetailLieOnEachOther) {
    // Averages of an inclined plane are on it. Cells of 80 m leave out three columns in the east and three
    // rows in the south.
    const test::TemporaryFolder folder;
    const fs::path file =
        RasterFile{131, 115}.write(folder / "dem.tif", [](int i, int j) { return 100 + 2.0 * i + 1.0 * j; });
    for (const std::optional<double>& base : {std::optional<double>(), std::optional(2.0)}) {
        TerrainOptions options{.exaggerate = 1.5, .base = base, .size = 150};
        TerrainInfo first, coarse;
        extract_terrain(file, options, &first);
        options.first_level = &first;
        options.cell = 80;
        const Mesh mesh = extract_terrain(file, options, &coarse);
        EXPECT_EQ(coarse.centre, first.centre);
        EXPECT_EQ(coarse.mm_per_metre, first.mm_per_metre);
        EXPECT_EQ(coarse.zero, first.zero);
        const double mm = first.mm_per_metre;
        double highest = -1e9, lowest = 1e9;  // above the plane, metres
        for (const Vec3f& p : mesh.points) {
            const double i = (p[0] / mm + first.centre[0] - 500005) / 10;
            const double j = (p[1] / mm + first.centre[1] - (5000000 - 1145)) / 10;
            const double above = p[2] / mm / 1.5 + first.zero - (100 + 2 * i + j);
            highest = std::max(highest, above);
            lowest = std::min(lowest, above);
        }
        EXPECT_NEAR(highest, 0, 1e-3);
        if (!base) {
            EXPECT_NEAR(lowest, 0, 1e-3);
        } else {
            EXPECT_EQ(measure(mesh).lower[2], 0);
            EXPECT_NEAR(first.zero, 100 - 2 / mm / 1.5, 1e-9);
        }
    }
}

TEST(Terrain, ErrorIncludesTheHeightsBetweenSamples) {
    // A zigzag of 8 m: averages of two samples differ by 4 m everywhere.
    const test::TemporaryFolder folder;
    const fs::path file =
        RasterFile{64, 64}.write(folder / "dem.tif", [](int i, int) { return i % 2 == 0 ? 100.0 : 108.0; });
    TerrainInfo info;
    extract_terrain(file, {.cell = 20}, &info);
    EXPECT_NEAR(info.rms_error, 4, 1e-3);
    EXPECT_NEAR(info.max_error, 4, 1e-3);
}

TEST(Terrain, AveragesSamplesEvenIfTheFileHasOverviews) {
    const test::TemporaryFolder folder;
    const auto spikes = [](int i, int j) { return i % 4 == 0 && j % 4 == 3 ? 1000.0 : 0.0; };
    const fs::path file = RasterFile{128, 128}.write(folder / "dem.tif", spikes);
    GDALDatasetH dataset = GDALOpen(file.c_str(), GA_Update);
    const int factors[] = {2, 4};
    ASSERT_EQ(GDALBuildOverviews(dataset, "NEAREST", 2, factors, 0, nullptr, nullptr, nullptr), CE_None);
    GDALClose(dataset);
    TerrainInfo info;
    extract_terrain(file, {.cell = 40}, &info);
    EXPECT_NEAR(info.lowest, 1000 / 16.0, 1e-9);
    EXPECT_NEAR(info.highest, 1000 / 16.0, 1e-9);
}

TEST(Terrain, InDegreesIsProjectedToMetres) {
    const test::TemporaryFolder folder;
    RasterFile degrees{121, 121};
    degrees.epsg = 4326;
    degrees.cell = 1.0 / 12000;  // 0.01 degrees in total
    degrees.west = 15;
    degrees.north = 60;
    const fs::path file =
        degrees.write(folder / "dem.tif", [](int i, int j) { return 100 + 0.1 * i + 0.05 * j; });
    TerrainInfo info;
    const MeshMeasures m = measure(extract_terrain(file, {}, &info));
    EXPECT_EQ(info.projection, "WGS 84 / UTM zone 33N");
    EXPECT_NEAR(info.centre[0], 500000 + 0.005 * 111320 * 0.5, 20);
    EXPECT_NEAR((m.upper[0] - m.lower[0]) / 1e6, 1.1132 * 0.5, 0.02)
        << "km; a degree east is half as wide at 60";
    EXPECT_NEAR((m.upper[1] - m.lower[1]) / 1e6, 1.1141, 0.02);
    EXPECT_LT(info.rms_error, 0.01);
}

TEST(Terrain, CountsLongitudesFromAnyMeridian) {
    const test::TemporaryFolder folder;
    const auto info_at = [&](double west) {
        RasterFile degrees{60, 60};
        degrees.epsg = 4326;
        degrees.cell = 1.0 / 60;
        degrees.west = west;
        degrees.north = 41;
        TerrainInfo info;
        extract_terrain(degrees.write(folder / "dem.tif", hills), {}, &info);
        return info;
    };
    for (const double west : {-111.0, -180.5, -180.0}) {
        const TerrainInfo a = info_at(west), b = info_at(west + 360);
        EXPECT_EQ(a.projection, west == -111 ? "WGS 84 / UTM zone 12N" : "WGS 84 / UTM zone 1N");
        EXPECT_EQ(a.projection, b.projection) << west;
        EXPECT_EQ(a.samples, b.samples) << west;
        EXPECT_NEAR(a.centre[0], b.centre[0], 1e-3) << west;
        EXPECT_EQ(a.unknown_samples, b.unknown_samples) << west;
    }
}

TEST(Terrain, WarnsOfProjectionsWithFalseLengths) {
    const test::TemporaryFolder folder;
    const auto warning = [&](int epsg, double west, double north, double cell) {
        RasterFile raster{40, 40};
        raster.epsg = epsg;
        raster.west = west;
        raster.north = north;
        raster.cell = cell;
        raster.unit = "m";
        TerrainInfo info;
        extract_terrain(raster.write(folder / "dem.tif", flat), {}, &info);
        return info.warnings.empty() ? "" : info.warnings.front();
    };
    EXPECT_NE(warning(3857, 1200000, 6000000, 30).find("1.48 times"), std::string::npos) << "at 47.3 degrees";
    EXPECT_NE(warning(4326, -40, 60, 1).find("times the true ones"), std::string::npos) << "40 degrees wide";
    EXPECT_NE(warning(4087, 1200000, 6679169, 30).find("1.99 times"), std::string::npos)
        << "true to the north, but not to the east, at 60 degrees";

    EXPECT_EQ(warning(3857, 1200000, 600, 30), "") << "at the equator";
    EXPECT_EQ(warning(32633, 500000, 5000000, 10), "");
    EXPECT_EQ(warning(4326, 10, 60, 0.05), "") << "2 degrees";
    EXPECT_EQ(warning(2225, 6500000, 2000000, 100), "") << "in US survey feet";
    EXPECT_EQ(warning(3413, -20000, 20000, 1000), "") << "around the pole";
    EXPECT_EQ(warning(27572, 600000, 2200000, 100), "") << "a geographic system in grads, from Paris";
}

TEST(Terrain, WithRowsFromTheSouthIsTheSame) {
    const test::TemporaryFolder folder;
    RasterFile turned{70, 50};
    turned.south_up = true;
    const Mesh a = extract_terrain(RasterFile{70, 50}.write(folder / "north.tif", hills));
    const Mesh b = extract_terrain(turned.write(folder / "south.tif", hills));
    EXPECT_EQ(test::mesh_hash(a), test::mesh_hash(b));
}

TEST(Terrain, InAnyUnitBecomesMetres) {
    const test::TemporaryFolder folder;
    RasterFile raster{10, 10};
    TerrainInfo info;
    const auto expect_metres = [&](const std::string& unit, double metres, std::size_t warnings = 0) {
        raster.unit = unit;
        extract_terrain(raster.write(folder / "dem.tif", [](int i, int) { return 1.0 + 0.001 * i; }), {},
                        &info);
        EXPECT_NEAR(info.lowest, metres, 1e-12 * metres) << unit;
        EXPECT_EQ(info.warnings.size(), warnings) << unit;
    };
    for (const char* unit : {"", "m", "metre", "Meters"}) expect_metres(unit, 1);
    expect_metres("mm", 0.001);
    expect_metres("cm", 0.01);
    expect_metres("decimetre", 0.1);
    expect_metres("km", 1000);
    for (const char* unit : {"ft", "foot", "Feet", "International Foot", "Foot (International)"})
        expect_metres(unit, 0.3048);
    for (const char* unit : {"US survey foot", "ftUS", "us-ft", "Foot_US", "US survey ft"})
        expect_metres(unit, 1200.0 / 3937);
    expect_metres("fathom", 1, 1);
    EXPECT_NE(info.warnings.at(0).find("'fathom'"), std::string::npos);
}

TEST(Terrain, WarnsOfHeightsWithoutAUnitBesideCoordinatesInFeet) {
    const test::TemporaryFolder folder;
    const auto warnings = [&](const std::string& unit, int vertical_epsg) {
        RasterFile raster{10, 10};
        raster.epsg = 2226;  // US survey feet
        raster.west = 6500000;
        raster.north = 2000000;
        raster.unit = unit;
        raster.vertical_epsg = vertical_epsg;
        TerrainInfo info;
        extract_terrain(raster.write(folder / "dem.tif", hills), {}, &info);
        return info.warnings;
    };
    ASSERT_EQ(warnings("", 0).size(), 1u);
    EXPECT_NE(warnings("", 0).front().find("by 0.304801"), std::string::npos) << warnings("", 0).front();
    EXPECT_TRUE(warnings("m", 0).empty());
    EXPECT_TRUE(warnings("ft", 0).empty());
    EXPECT_TRUE(warnings("", 6360).empty());
}

TEST(Terrain, OfAVerticalAxisInFeetBecomesMetresOnce) {
    const test::TemporaryFolder folder;
    const auto expect_metres = [&](const fs::path& file) {
        TerrainInfo info;
        extract_terrain(file, {}, &info);
        EXPECT_NEAR(info.lowest, 1000 * 1200.0 / 3937, 1e-9) << file;
    };
    const auto height = [](int, int) { return 1000.0; };
    RasterFile raster{10, 10};
    raster.vertical_epsg = 6360;  // NAVD88 in US survey feet
    expect_metres(raster.write(folder / "utm.tif", height));
    raster.epsg = 4269;
    raster.west = -105;
    raster.north = 40;
    raster.cell = 1.0 / 3600;
    const fs::path degrees = raster.write(folder / "degrees.tif", height);
    expect_metres(degrees);

    // Only the coordinate system of this format has the unit.
    GDALDatasetH from = GDALOpen(degrees.c_str(), GA_ReadOnly);
    GDALClose(GDALCreateCopy(GDALGetDriverByName("AAIGrid"), (folder / "degrees.asc").c_str(), from, 0,
                             nullptr, nullptr, nullptr));
    GDALClose(from);
    fs::remove(folder / "degrees.asc.aux.xml");
    expect_metres(folder / "degrees.asc");
}

TEST(Terrain, DoesNotDependOnThreads) {
    const test::TemporaryFolder folder;
    const fs::path file = RasterFile{140, 140}.write(folder / "dem.tif", rough_with_holes);
    const auto hash = [&](int threads) {
        return test::mesh_hash(extract_terrain(file, {.base = 4, .size = 80, .threads = threads}));
    };
    EXPECT_EQ(hash(1), hash(2));
    EXPECT_EQ(hash(1), hash(7));
}

TEST(Terrain, HasUnitNormalsThatPointUp) {
    const test::TemporaryFolder folder;
    const Mesh mesh = extract_terrain(RasterFile{30, 30}.write(folder / "dem.tif", hills));
    ASSERT_EQ(mesh.normals.size(), mesh.points.size());
    for (const Vec3f& n : mesh.normals) {
        EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-5);
        EXPECT_GT(n[2], 0);
    }
}

template <class E>
std::string refusal(const fs::path& file, const TerrainOptions& options = {}) {
    try {
        extract_terrain(file, options);
    } catch (const E& error) {
        return error.what();
    }
    ADD_FAILURE() << file << " was extracted";
    return {};
}

TEST(Terrain, RefusesInvalidInput) {
    const test::TemporaryFolder folder;
    refusal<IoError>(folder / "missing.tif");
    refusal<InputError>(folder.path());
    test::write_file(folder / "text.tif", "not a raster");
    refusal<InputError>(folder / "text.tif");
    test::write_file(folder / "elsewhere.vrt",
                     "<VRTDataset rasterXSize=\"2\" rasterYSize=\"2\"><VRTRasterBand dataType=\"Byte\" "
                     "band=\"1\"><SimpleSource><SourceFilename>/etc/passwd</SourceFilename></SimpleSource>"
                     "</VRTRasterBand></VRTDataset>");
    refusal<InputError>(folder / "elsewhere.vrt");
    refusal<InputError>(RasterFile{1, 9}.write(folder / "line.tif", hills));
    refusal<InputError>(RasterFile{9, 9}.write(folder / "empty.tif", [](int, int) { return kUnknown; }));
    const fs::path good = RasterFile{9, 9}.write(folder / "good.tif", hills);
    for (const double bad : {-1.0, kUnknown, std::numeric_limits<double>::infinity()}) {
        refusal<InputError>(good, {.cell = bad});
        refusal<InputError>(good, {.exaggerate = bad});
        refusal<InputError>(good, {.base = bad});
        refusal<InputError>(good, {.size = bad});
    }
    refusal<OptionError>(good, {.base = 1001, .size = 100});
    refusal<OptionError>(good, {.cell = 1e9});
    EXPECT_NE(refusal<LimitError>(good, {.exaggerate = 1e9}).find("a smaller options.exaggerate"),
              std::string::npos);
    EXPECT_THROW(extract_terrain(good, {.progress = [](double) { return false; }}), Cancelled);
}

TEST(Terrain, RefusesHeightsThatAreTooLargeForItsLayers) {
    const test::TemporaryFolder folder;
    constexpr double kUnmarked = -3.4028234663852886e38;  // no height, in rasters that do not say so
    const auto expect_hint = [&](const std::function<double(int, int)>& height,
                                 const TerrainOptions& options = {}) {
        const fs::path file = RasterFile{9, 9}.write(folder / "dem.tif", height);
        EXPECT_NE(refusal<InputError>(file, options).find("-a_nodata"), std::string::npos);
    };
    expect_hint([](int i, int) { return i == 3 ? kUnmarked : 100; });
    expect_hint([](int, int) { return kUnmarked; });
    expect_hint([](int, int) { return 1e20; }, {.base = 3, .size = 50});
    expect_hint(flat, {.exaggerate = 1e308});
    const fs::path high = RasterFile{9, 9}.write(folder / "high.tif", [](int i, int) { return 1e12 + i; });
    EXPECT_FALSE(extract_terrain(high).triangles.empty());
}

TEST(Terrain, RefusesNumbersOfColours) {
    const test::TemporaryFolder folder;
    const fs::path file = folder / "colours.tif";
    GDALAllRegister();
    GDALDatasetH dataset = GDALCreate(GDALGetDriverByName("GTiff"), file.c_str(), 9, 9, 1, GDT_Byte, nullptr);
    GDALColorTableH table = GDALCreateColorTable(GPI_RGB);
    const GDALColorEntry red{255, 0, 0, 255};
    GDALSetColorEntry(table, 0, &red);
    GDALSetRasterColorTable(GDALGetRasterBand(dataset, 1), table);
    GDALDestroyColorTable(table);
    GDALClose(dataset);
    EXPECT_NE(refusal<InputError>(file, {.cell = 1}).find("colour table"), std::string::npos);
}

TEST(Terrain, WarnsOfHeightsThatMayMarkUnknownSamples) {
    const test::TemporaryFolder folder;
    const auto warnings = [&](double lowest, const std::string& unit) {
        RasterFile raster{9, 9};
        raster.unit = unit;
        TerrainInfo info;
        extract_terrain(
            raster.write(folder / "dem.tif", [&](int i, int j) { return i == 4 && j == 4 ? lowest : 100; }),
            {}, &info);
        return info.warnings;
    };
    for (const char* unit : {"m", "ft"}) {
        const std::vector<std::string> found = warnings(-32768, unit);
        ASSERT_EQ(found.size(), 1u) << unit;
        EXPECT_NE(found.front().find("-a_nodata"), std::string::npos) << found.front();
    }
    EXPECT_TRUE(warnings(-9800, "m").empty());
    EXPECT_TRUE(warnings(-9999, "m").empty()) << "the raster names this value";
}

TEST(Terrain, CanBeCancelledWhileReading) {
    // The cell is so small that one strip takes minutes, but GDAL can be cancelled within it.
    const test::TemporaryFolder folder;
    const fs::path file = RasterFile{64, 64}.write(folder / "dem.tif", hills);
    int asked = 0;
    EXPECT_THROW(extract_terrain(file, {.cell = 0.02, .progress = [&](double) { return ++asked < 5; }}),
                 Cancelled);
    EXPECT_EQ(asked, 5) << "and not again";
    double last = 0;
    extract_terrain(file, {.progress = [&](double fraction) {
                        EXPECT_GE(fraction, last);
                        last = fraction;
                        return true;
                    }});
    EXPECT_EQ(last, 1);
}

TEST(Terrain, WithoutGeoreferenceNeedsACell) {
    const test::TemporaryFolder folder;
    RasterFile bare{40, 30};
    bare.placed = false;
    bare.epsg = 0;
    const fs::path file = bare.write(folder / "bare.tif", hills);
    EXPECT_NE(refusal<GeometryError>(file).find("options.cell"), std::string::npos);
    TerrainInfo info;
    const MeshMeasures m = measure(extract_terrain(file, {.cell = 25}, &info));
    EXPECT_FALSE(info.georeferenced);
    EXPECT_NEAR(m.upper[0] - m.lower[0], 39 * 25e3, 1);
    EXPECT_LT(info.rms_error, 1e-3);

    bare.epsg = 2263;  // coordinates in feet, of which there are none
    extract_terrain(bare.write(folder / "feet.tif", hills), {.cell = 25}, &info);
    EXPECT_EQ(info.cell, (std::array<double, 3>{25, 25, 25}));
}

TEST(Terrain, OfMountStHelens) {
    const char* const data = std::getenv("MARROW_TEST_DATA");
    const fs::path dem = fs::path(data ? data : "") / "dem_sthelens/dem_sthelens/SainteHelens.dem";
    if (!data || !fs::exists(dem)) GTEST_SKIP() << "no dem_sthelens in MARROW_TEST_DATA";
    TerrainInfo info;
    const Mesh surface = extract_terrain(dem, {}, &info);
    EXPECT_EQ(info.format, "USGSDEM");
    EXPECT_EQ(info.lowest, 682);
    EXPECT_EQ(info.highest, 2543);
    EXPECT_LT(info.rms_error, 1e-3);
    EXPECT_EQ(test::manifold_fault(surface, true), "");
    const Mesh block = extract_terrain(dem, {.base = 3, .size = 150});
    EXPECT_EQ(test::manifold_fault(block), "");
    EXPECT_EQ(measure(block).components, 1);
}

}  // namespace
}  // namespace marrow
