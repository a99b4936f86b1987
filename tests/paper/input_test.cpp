// The input of Visutsak 2020: 32, 64 or 128 slices of 256 x 256 in 8-bit grey, as pictures, from CT and MR.
#include <gtest/gtest.h>

#include <vtkImageData.h>
#include <vtkJPEGWriter.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkTIFFWriter.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <sstream>

#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>
#include <marrow/scan_io.h>

#include "cranium.h"
#include "support/command_line.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSide = 256;

template <class Writer>
void write_with(const fs::path& file, const std::uint8_t* slice) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(kSide, kSide, 1);
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    auto* to = static_cast<std::uint8_t*>(image->GetScalarPointer());
    for (std::int64_t row = 0; row < kSide; ++row)  // VTK counts rows from the bottom
        std::copy_n(slice + row * kSide, kSide, to + (kSide - 1 - row) * kSide);
    vtkNew<Writer> writer;
    writer->SetInputData(image);
    writer->SetFileName(file.c_str());
    if constexpr (std::is_same_v<Writer, vtkJPEGWriter>) writer->SetQuality(95);
    writer->Write();
}

void write_bmp(const fs::path& file, const std::uint8_t* slice) {
    constexpr std::uint32_t kHeader = 14 + 40 + 4 * 256;
    std::string out = "BM";
    const auto put = [&](auto value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (const std::uint32_t v : {kHeader + std::uint32_t{kSide * kSide}, 0u, kHeader}) put(v);
    for (const std::uint32_t v : {40u, std::uint32_t{kSide}, std::uint32_t{kSide}}) put(v);
    for (const std::uint16_t v : {std::uint16_t{1}, std::uint16_t{8}}) put(v);  // planes, bits
    for (const std::uint32_t v : {0u, std::uint32_t{kSide * kSide}, 2835u, 2835u, 256u, 0u}) put(v);
    for (std::uint32_t grey = 0; grey < 256; ++grey) put(grey * 0x010101u);
    for (std::int64_t row = kSide; row-- > 0;)  // from the bottom
        out.append(reinterpret_cast<const char*>(slice + row * kSide), kSide);
    test::write_file(file, out);
}

// The slices of an 8-bit volume, numbered without leading zeros: natural order is the reader's work.
void write_slices(const fs::path& folder, const Volume& volume, const std::string& format) {
    fs::create_directories(folder);
    for (std::int64_t k = 0; k < volume.geometry().dims[2]; ++k) {
        const std::uint8_t* slice = volume.samples<std::uint8_t>() + k * kSide * kSide;
        const fs::path file = folder / ("slice" + std::to_string(k + 1) + "." + format);
        if (format == "png") write_with<vtkPNGWriter>(file, slice);
        if (format == "tif") write_with<vtkTIFFWriter>(file, slice);
        if (format == "jpg") write_with<vtkJPEGWriter>(file, slice);
        if (format == "bmp") write_bmp(file, slice);
    }
}

/// A scan as the paper takes it, and an isovalue for it.
struct PaperInput {
    Volume slices;
    double isovalue;
};

Geometry paper_geometry(std::int64_t slices, const Vec3d& spacing) {
    Geometry g;
    g.dims = {kSide, kSide, slices};
    g.spacing = spacing;
    return g;
}

// A window of the Hounsfield scale, and as many slices as asked for between the first and the last.
PaperInput from_ct(const Volume& ct, std::int64_t slices) {
    constexpr double kLow = -200, kHigh = 1000, kBone = 226;
    const auto& from = ct.geometry();
    const double step = static_cast<double>(from.dims[2] - 1) / static_cast<double>(slices - 1);
    const auto grey = [&](double hu) { return 255 * (hu - kLow) / (kHigh - kLow); };
    return {test::sampled<std::uint8_t>(
                paper_geometry(slices, {from.spacing[0], from.spacing[1], from.spacing[2] * step}),
                [&](std::int64_t x, std::int64_t y, std::int64_t k) {
                    const double z =
                        std::min(step * static_cast<double>(k), static_cast<double>(from.dims[2] - 1));
                    const std::int64_t below = std::min(static_cast<std::int64_t>(z), from.dims[2] - 2);
                    const std::int16_t* s = ct.samples<std::int16_t>() + (below * kSide + y) * kSide + x;
                    const double t = z - static_cast<double>(below);
                    return std::clamp(grey((1 - t) * s[0] + t * s[kSide * kSide]), 0.0, 255.0) + 0.5;
                }),
            grey(kBone)};
}

// The middle of a smaller 8-bit volume, with black round it.
PaperInput from_mr(const Volume& mr, std::int64_t slices) {
    const auto& from = mr.geometry();
    const std::int64_t shift[3] = {(kSide - from.dims[0]) / 2, (kSide - from.dims[1]) / 2,
                                   (slices - from.dims[2]) / 2};
    PaperInput input{
        test::sampled<std::uint8_t>(
            paper_geometry(slices, from.spacing),
            [&](std::int64_t x, std::int64_t y, std::int64_t z) {
                const std::int64_t at[3] = {x - shift[0], y - shift[1], z - shift[2]};
                for (int axis = 0; axis < 3; ++axis) {
                    if (at[axis] < 0 || at[axis] >= from.dims[axis]) return std::uint8_t{0};
                }
                return mr.samples<std::uint8_t>()[(at[2] * from.dims[1] + at[1]) * from.dims[0] + at[0]];
            }),
        0};
    input.isovalue = otsu_isovalue(histogram(input.slices));
    return input;
}

/// Reads a folder back through the command line, as `--spacing` says.
test::Outcome surface_of_folder(const fs::path& folder, const PaperInput& input, const fs::path& output) {
    std::ostringstream spacing, isovalue;
    spacing.precision(17), isovalue.precision(17);
    const Vec3d& s = input.slices.geometry().spacing;
    spacing << s[0] << ',' << s[1] << ',' << s[2];
    isovalue << input.isovalue;
    return test::marrow_with(
        {folder, "-o", output, "--spacing", spacing.str(), "--isovalue", isovalue.str()});
}

void expect_surface_back(const PaperInput& input) {
    const test::TemporaryFolder work;
    Mesh expected = extract_isosurface(input.slices, input.isovalue, {.closed = true});
    turn_normals_outward(expected);  // as the command line does
    ASSERT_GT(expected.triangles.size(), 50'000u) << "a head, not noise";
    write_mesh(expected, work / "expected.ply");
    const std::string expected_file = test::read_file(work / "expected.ply");

    for (const std::string format : {"png", "tif", "bmp"}) {
        write_slices(work / format, input.slices, format);
        const test::Outcome outcome = surface_of_folder(work / format, input, work / (format + ".ply"));
        ASSERT_EQ(outcome.code, apps::kOk) << outcome.err;
        EXPECT_TRUE(test::read_file(work / (format + ".ply")) == expected_file)
            << format << ": not the same bytes";
    }

    // JPEG at quality 95 moves grey values by a few levels; the surface follows by a small part of a sample.
    write_slices(work / "jpg", input.slices, "jpg");
    const test::Outcome outcome = surface_of_folder(work / "jpg", input, work / "jpg.ply");
    ASSERT_EQ(outcome.code, apps::kOk) << outcome.err;
    ScanOptions options;
    options.spacing = input.slices.geometry().spacing;
    const Volume decoded = read_scan(work / "jpg", options);
    Mesh surface = extract_isosurface(decoded, input.isovalue, {.closed = true});
    turn_normals_outward(surface);
    write_mesh(surface, work / "from_decoded.ply");
    EXPECT_TRUE(test::read_file(work / "jpg.ply") == test::read_file(work / "from_decoded.ply"));
    const MeshDistance moved = mesh_distance(surface, expected, {.samples = 20'000});
    EXPECT_GT(moved.mean, 0);
    EXPECT_LT(moved.mean, 0.1 * input.slices.geometry().spacing[0]);
}

class PaperSlices : public testing::TestWithParam<std::int64_t> {};
INSTANTIATE_TEST_SUITE_P(Of, PaperSlices, testing::Values(32, 64, 128));

TEST_P(PaperSlices, OfACtGiveItsSurfaceBack) {
    const auto ct = bench::cranium();
    if (!ct) GTEST_SKIP() << "no Cranium: install invesalius-examples";
    expect_surface_back(from_ct(*ct, GetParam()));
}

TEST_P(PaperSlices, OfAnMrGiveItsSurfaceBack) {
    const fs::path head = "/usr/share/mricron/templates/ch2.nii.gz";
    if (!fs::exists(head)) GTEST_SKIP() << "no MR head: install mricron-data";
    const Volume mr = read_scan(head);
    ASSERT_EQ(mr.type(), SampleType::uint8);
    expect_surface_back(from_mr(mr, GetParam()));
}

// What 8 bits cost: the surface of the windowed slices lies close to that of the scan in Hounsfield units.
TEST(PaperInput, EightBitsMoveTheSurfaceLittle) {
    auto ct = bench::cranium();
    if (!ct) GTEST_SKIP() << "no Cranium: install invesalius-examples";
    const PaperInput input = from_ct(*ct, ct->geometry().dims[2]);  // every slice as it is
    ct->set_geometry(input.slices.geometry());                      // pictures do not say how they lie
    const MeshDistance moved = mesh_distance(extract_isosurface(input.slices, input.isovalue),
                                             extract_isosurface(*ct, 226), {.samples = 20'000});
    EXPECT_GT(moved.mean, 0);
    EXPECT_LT(moved.mean, 0.01);
}

}  // namespace
}  // namespace marrow
