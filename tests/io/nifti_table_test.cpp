// The rows of the NIfTI table in docs/reliability.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <marrow/error.h>

#include "support/counted_scan.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

TEST(NiftiTable, SformGoesBeforeQformAndQformBeforeSpacing) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.pixdim = {-1, 2, 3, 4};  // qfac -1
    n.quaternion = {0, 0, 1};  // half a turn about z
    n.offset = {10, 20, 30};
    n.srow = {{{1, 0, 0, 1}, {0, 1, 0, 2}, {0, 0, 1, 3}}};
    n.qform_code = n.sform_code = 1;
    const auto read = [&](ScanInfo* info = nullptr) {
        return read_scan(write_file(folder / "n.nii", n.header() + bytes_of(samples())), {}, info).geometry();
    };
    expect_at(read(), {1, 1, 1}, {-2, -3, 4}, 1e-6);
    n.sform_code = 0;
    expect_at(read(), {1, 1, 1}, {-(10 - 2), -(20 - 3), 30 - 4}, 1e-6);
    n.qform_code = 0;
    ScanInfo info;
    expect_at(read(&info), {1, 1, 1}, {-2, -3, 4}, 1e-6);
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "neither sform nor qform");
}

// A NIfTI-2 header of 4 x 3 x 2 samples, with four bytes for extensions.
std::string second_version(std::int64_t vox_offset) {
    std::string out(544, '\0');
    const auto put = [&](std::size_t at, auto value) {
        const std::string bytes = bytes_of(value);
        out.replace(at, bytes.size(), bytes);
    };
    put(0, std::int32_t{540});
    out.replace(4, 8, std::string("n+2\0\r\n\x1a\n", 8));
    put(12, std::int16_t{4});
    const std::array<std::int64_t, 8> dim = {3, nx, ny, nz, 1, 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i) {
        put(16 + 8 * i, dim[i]);
        put(104 + 8 * i, 1.0);
    }
    put(168, vox_offset);
    return out;
}

TEST(NiftiTable, SamplesComeAfterTheHeader) {
    const TemporaryFolder folder;
    const auto first_version = [](float vox_offset) {
        std::string out = nifti().header();
        return out.replace(108, 4, bytes_of(vox_offset));
    };
    const auto write = [&](const std::string& bytes) { return write_file(folder / "n.nii", bytes); };
    const std::string data = bytes_of(samples());
    for (const std::string& bytes :
         {first_version(0) + data, first_version(352) + data, first_version(360) + "8 bytes." + data,
          second_version(0) + data, second_version(544) + data, second_version(552) + "8 bytes." + data})
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(write(bytes))), samples());
    for (const std::string& bytes : {first_version(348), second_version(352), second_version(-8)})
        contains(refusal<InputError>(write(bytes + data)), "before the end of the header");
}

TEST(NiftiTable, UnitsOfLength) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.units = 3;  // micrometres
    n.pixdim = {1, 500, 500, 2000};
    const Geometry g = read_scan(write_file(folder / "n.nii", n.header() + bytes_of(samples()))).geometry();
    EXPECT_NEAR(g.spacing[2], 2, 1e-9);
}

template <class T>
void expect_nifti_type(std::int16_t datatype, bool big_endian) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.datatype = datatype;
    n.big_endian = big_endian;
    std::vector<T> values;
    for (int i = 0; i < nx * ny * nz; ++i) values.push_back(static_cast<T>(i % 2 ? i * 1000003 : -i * 71));
    const Volume v = read_scan(write_file(folder / "n.nii", n.header() + bytes_of(values, big_endian)));
    EXPECT_EQ(samples_of<T>(v), values);
}

TEST(NiftiTable, TypesAreKept) {
    for (const bool big : {false, true}) {
        expect_nifti_type<std::uint8_t>(2, big);
        expect_nifti_type<std::int16_t>(4, big);
        expect_nifti_type<std::int32_t>(8, big);
        expect_nifti_type<float>(16, big);
        expect_nifti_type<double>(64, big);
        expect_nifti_type<std::int8_t>(256, big);
        expect_nifti_type<std::uint16_t>(512, big);
    }
}

TEST(NiftiTable, LargeIntegersBecomeExactDoublesOrAreRefused) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.datatype = 1024;
    std::vector<std::int64_t> values(nx * ny * nz, 3);
    values[5] = (std::int64_t{1} << 53) - 1;
    const fs::path path = folder / "n.nii";
    EXPECT_EQ(samples_of<double>(read_scan(write_file(path, n.header() + bytes_of(values))))[5],
              9007199254740991.0);
    values[5] += 2;
    contains(refusal<InputError>(write_file(path, n.header() + bytes_of(values))), "2^53");
    n.datatype = 768;
    std::vector<std::uint32_t> words(nx * ny * nz, 4294967295u);
    EXPECT_EQ(samples_of<double>(read_scan(write_file(path, n.header() + bytes_of(words))))[0], 4294967295.0);
}

TEST(NiftiTable, SlopeAndIntercept) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    const auto read = [&] {
        return read_scan(write_file(folder / "n.nii", n.header() + bytes_of(samples())));
    };
    n.slope = 0, n.intercept = 5;
    EXPECT_EQ(samples_of<std::int16_t>(read()), samples());
    n.slope = 1, n.intercept = 0;
    EXPECT_EQ(samples_of<std::int16_t>(read()), samples());
    n.slope = NAN;
    EXPECT_EQ(samples_of<std::int16_t>(read()), samples());
    n.slope = 0.5, n.intercept = -1;
    EXPECT_EQ(samples_of<float>(read())[0], -4.5f);
    n.slope = INFINITY;
    write_file(folder / "n.nii", n.header() + bytes_of(samples()));
    contains(refusal<InputError>(folder / "n.nii"), "scl_slope");
}

// Where a rescale has a fraction, 8 and 16 bits can stay as they are; all else is as without the option.
TEST(NiftiTable, FractionsMayStayStored) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    const auto scan = [&](const std::string& data) {
        return write_file(folder / "n.nii", n.header() + data);
    };
    const auto is_unchanged = [](const fs::path& path) {
        const Volume kept = read_scan(path, {.keep_stored = true}), plain = read_scan(path);
        return kept.rescale().is_identity() && kept.type() == plain.type() && kept.bytes() == plain.bytes() &&
               std::memcmp(kept.data(), plain.data(), kept.bytes()) == 0;
    };
    for (const auto& [slope, intercept] : {std::pair{0.5f, -1.0f}, {1.0f, -1000.25f}, {3.0f, 0.5f}}) {
        n.slope = slope, n.intercept = intercept;
        const fs::path path = scan(bytes_of(samples()));
        const Volume kept = read_scan(path, {.keep_stored = true});
        EXPECT_EQ(samples_of<std::int16_t>(kept), samples());
        EXPECT_EQ(kept.rescale(), (Rescale{slope, intercept}));
        const std::vector<float> values = samples_of<float>(read_scan(path));
        ASSERT_EQ(kept.bytes() * 2, values.size() * sizeof(float));
        for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_EQ(static_cast<float>(kept.rescale().value(samples()[i])), values[i]);

        std::vector<std::int16_t> slices(nx * ny);
        const SliceSource source = open_slices(path, {.keep_stored = true});
        EXPECT_EQ(source.rescale, kept.rescale());
        ASSERT_EQ(source.type, SampleType::int16);
        source.read(1, 2, slices.data());
        EXPECT_TRUE(std::equal(slices.begin(), slices.end(), samples().begin() + nx * ny));
        EXPECT_EQ(inspect_scan(path, {.keep_stored = true}).series[0].memory, kept.bytes());
        EXPECT_EQ(inspect_scan(path).series[0].memory, 2 * kept.bytes());
    }
    n.slope = 2, n.intercept = -1024;
    EXPECT_TRUE(is_unchanged(scan(bytes_of(samples())))) << "whole numbers";
    n.slope = -0.5;
    EXPECT_TRUE(is_unchanged(scan(bytes_of(samples())))) << "larger samples have smaller values";
    n.slope = 0.5;
    n.datatype = 8;
    EXPECT_TRUE(is_unchanged(scan(bytes_of(std::vector<std::int32_t>(nx * ny * nz, 7))))) << "32 bits";
    n.datatype = 16;
    EXPECT_TRUE(is_unchanged(scan(bytes_of(std::vector<float>(nx * ny * nz, 7))))) << "float32";
    n.datatype = 2;
    const std::vector<std::uint8_t> bytes(nx * ny * nz, 200);
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(scan(bytes_of(bytes)), {.keep_stored = true})), bytes);
}

TEST(NiftiTable, PairsAndGzip) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    const std::string data = bytes_of(samples());
    EXPECT_EQ(
        samples_of<std::int16_t>(read_scan(write_file(folder / "a.nii.gz", gzipped(n.header() + data)))),
        samples());
    n.pair = true;
    write_file(folder / "b.hdr", n.header());
    write_file(folder / "b.img", data);
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder / "b.hdr")), samples());
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder / "b.img")), samples());
    write_file(folder / "c.hdr.gz", gzipped(n.header()));
    contains(refusal<IoError>(folder / "c.hdr.gz"), ".img");
    write_file(folder / "c.img.gz", gzipped(data));
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder / "c.hdr.gz")), samples());
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder / "c.img.gz")), samples());
}

TEST(NiftiTable, FourDimensionsNeedAVolume) {
    TemporaryFolder folder;
    NiftiWriter series = nifti();
    series.dim = {5, nx, ny, nz, 2, 3};
    std::string data;
    for (int v = 0; v < 6; ++v) {
        auto shifted = samples();
        for (auto& s : shifted) s = static_cast<std::int16_t>(s + 100 * v);
        data += bytes_of(shifted);
    }
    const fs::path plain = write_file(folder / "a.nii", series.header() + data);
    const fs::path zipped = write_file(folder / "b.nii.gz", gzipped(series.header() + data));
    const fs::path meta = write_file(
        folder / "c.mha",
        "ObjectType = Image\nNDims = 4\nDimSize = 4 3 2 6\nElementType = MET_SHORT\nElementSpacing = 1 1 1 "
        "1\nElementDataFile = LOCAL\n" +
            data);
    for (const auto& path : {plain, zipped, meta}) {
        SCOPED_TRACE(path.filename());
        contains(refusal<GeometryError>(path), "6 volumes; choose one from 0 to 5 with options.volume");
        ScanOptions options;
        options.volume = 4;
        const auto read = samples_of<std::int16_t>(read_scan(path, options));
        EXPECT_EQ(read[0], samples()[0] + 400);
        EXPECT_EQ(read[23], samples()[23] + 400);
        options.volume = 6;
        contains(refusal<OptionError>(path, options), "no volume 6");
        options.volume = -1;
        refusal<OptionError>(path, options);
    }
    // The last volume must exist even if the first is read.
    write_file(folder / "a.nii", series.header() + data.substr(0, data.size() - 1));
    ScanOptions first;
    first.volume = 0;
    contains(refusal<InputError>(folder / "a.nii", first), "truncated");
    // An axis with one value is ignored.
    series.dim = {5, nx, ny, nz, 1, 1};
    EXPECT_EQ(samples_of<std::int16_t>(
                  read_scan(write_file(folder / "a.nii", series.header() + bytes_of(samples())))),
              samples());
}

TEST(NiftiTable, ColourComplexAndVectorsAreRefused) {
    TemporaryFolder folder;
    const std::string data(4096, '\1');
    for (const auto& [datatype, what] :
         {std::pair(128, "colour"), std::pair(2304, "colour"), std::pair(32, "complex"),
          std::pair(1792, "complex"), std::pair(2048, "complex"), std::pair(1, "type 1"),
          std::pair(0, "type 0")}) {
        NiftiWriter n = nifti();
        n.datatype = static_cast<std::int16_t>(datatype);
        contains(refusal<InputError>(write_file(folder / "a.nii", n.header() + data)), what);
    }
    NiftiWriter vectors = nifti();
    vectors.dim = {5, nx, ny, nz, 1, 3};
    contains(refusal<GeometryError>(write_file(folder / "a.nii", vectors.header() + data)), "3 volumes");
}

TEST(NiftiTable, BadDimensionsAndSpacingsAreRefused) {
    TemporaryFolder folder;
    const auto refused = [&](const NiftiWriter& n) {
        return refusal<InputError>(write_file(folder / "a.nii", n.header() + bytes_of(samples())));
    };
    for (const int count : {0, 8, -1, 300}) {
        NiftiWriter n = nifti();
        n.dim[0] = static_cast<std::int16_t>(count);
        contains(refused(n), "dim[0]");
    }
    for (const std::size_t axis : {1u, 2u, 3u}) {
        for (const int size : {0, -5}) {
            NiftiWriter n = nifti();
            n.dim[axis] = static_cast<std::int16_t>(size);
            contains(refused(n), "is not a size");
        }
        NiftiWriter n = nifti();
        n.pixdim[axis] = 0;
        contains(refused(n), "is not a spacing");
    }
}

}  // namespace
}  // namespace marrow::test
