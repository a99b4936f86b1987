// read_scan, inspect_scan and open_slices for NRRD and MetaImage, and features of all volume files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include <marrow/error.h>

#include "support/counted_scan.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

using namespace std::string_literals;

// --- geometry

TEST(ReadGeometry, ShearedAndObliqueTheSameInNiftiNrrdAndMetaImage) {
    // LPS columns: x (1.5, 0.2, 0), y (-0.1, 0.9, 0.3), z (0.4, 0, -2.5): oblique, sheared, mirrored
    const Vec3d origin{-12.5, 30.25, 7}, corner{-12.5 + 4.5 - 0.2 + 0.4, 30.25 + 0.6 + 1.8, 7 + 0.6 - 2.5};
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.sform_code = 1;
    n.srow = {{{-1.5f, 0.1f, -0.4f, 12.5f}, {-0.2f, -0.9f, 0, -30.25f}, {0, 0.3f, -2.5f, 7}}};
    const std::string data = bytes_of(samples());
    const std::vector<fs::path> same = {
        write_file(folder / "a.nii", n.header() + data),
        write_file(
            folder / "b.nrrd",
            nrrd("space: left-posterior-superior\nspace directions: (1.5,0.2,0) (-0.1,0.9,0.3) (0.4,0,-2.5)\n"
                 "space origin: (-12.5,30.25,7)\n\n") +
                data),
        write_file(folder / "c.nrrd", nrrd("space: right-anterior-superior\nspace directions: (-1.5,-0.2,0) "
                                           "(0.1,-0.9,0.3) (-0.4,0,-2.5)\n"
                                           "space origin: (12.5,-30.25,7)\n\n") +
                                          data),
        write_file(folder / "d.nrrd",
                   nrrd("space: LAS\nspace directions: (1.5,-0.2,0) (-0.1,-0.9,0.3) (0.4,0,-2.5)\n"
                        "space origin: (-12.5,-30.25,7)\n\n") +
                       data),
        write_file(folder / "e.mha",
                   metaimage("TransformMatrix = 1.5 0.2 0 -0.1 0.9 0.3 0.4 0 -2.5\nOffset = -12.5 30.25 7\n"
                             "ElementSpacing = 1 1 1\n") +
                       data)};
    for (const auto& path : same) {
        SCOPED_TRACE(path.filename());
        ScanInfo info;
        const Volume v = read_scan(path, {}, &info);
        EXPECT_EQ(samples_of<std::int16_t>(v), samples());
        expect_at(v.geometry(), {0, 0, 0}, origin, 1e-5);
        expect_at(v.geometry(), {3, 2, 1}, corner, 1e-5);
        EXPECT_NEAR(v.geometry().spacing[2], std::hypot(0.4, 2.5), 1e-6);
        EXPECT_TRUE(info.warnings.empty());
    }
}

TEST(ReadNrrd, SpacingsAndMinsWithoutASpace) {
    TemporaryFolder folder;
    const auto read = [&](const std::string& fields) {
        return read_scan(write_file(folder / "n.nrrd", nrrd(fields) + "\n" + bytes_of(samples()))).geometry();
    };
    expect_at(read("spacings: 2 3 4\naxis mins: 10 20 30\n"), {1, 1, 1}, {12, 23, 34});
    expect_at(read("spacings: 2 3 4\naxis mins: 10 20 30\ncenters: cell cell node\n"), {0, 0, 0},
              {11, 21.5, 30});
    expect_at(read("space: LPS\nspace units: \"um\" \"um\" \"um\"\nspace directions: (500,0,0) (0,500,0) "
                   "(0,0,1000)\nspace origin: (1000,0,0)\n"),
              {1, 0, 1}, {1.5, 0, 1});
    const std::string space_units = "space: LPS\nspace units: \"um\" \"um\" \"um\"\n",
                      spacings = "spacings: 500 500 1000\naxis mins: 1000 0 0\n";
    expect_at(read(space_units + spacings), {1, 0, 1}, {1.5, 0, 1});
    expect_at(read(space_units + spacings + "units: \"um\" \"\" \"mm\"\n"), {1, 1, 1}, {1.5, 0.5, 1000});
}

// Programs that know no kinds tell an axis of values apart by its missing spacing.
TEST(ReadNrrd, AnAxisOfOneSampleWithoutASpacingIsNotOfSpace) {
    TemporaryFolder folder;
    const auto read = [&](const std::string& fields) {
        std::string header = nrrd(fields);
        header.replace(header.find("dimension: 3\nsizes: 4 3 2"), 25, "dimension: 4");
        return read_scan(write_file(folder / "n.nrrd", header + "\n" + bytes_of(samples())));
    };
    for (const char* fields :
         {"sizes: 1 4 3 2\nspacings: nan 2 3 4\n", "sizes: 4 1 3 2\nspacings: 2 NaN 3 4\n",
          "sizes: 4 3 2 1\nspacings: 2 3 4 nan\n"}) {
        SCOPED_TRACE(fields);
        const Volume volume = read(fields);
        EXPECT_EQ(volume.geometry().dims, (std::array<std::int64_t, 3>{nx, ny, nz}));
        EXPECT_EQ(volume.geometry().spacing, (Vec3d{2, 3, 4}));
        EXPECT_EQ(samples_of<std::int16_t>(volume), samples());
    }
    // One that has a spacing is of space.
    EXPECT_EQ(read("sizes: 4 6 1 1\nspacings: 2 3 4 nan\n").geometry().dims,
              (std::array<std::int64_t, 3>{4, 6, 1}));
}

TEST(ReadNrrd, KeysMayHaveColons) {
    TemporaryFolder folder;
    const std::string keys = "DICOM_0008:0060:=CT\nDICOM_0008:0061:=MR\ncontent: a:=b\n";
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(write_file(
                  folder / "n.nrrd", nrrd("spacings: 1 1 1\n" + keys) + "\n" + bytes_of(samples())))),
              samples());
}

TEST(ReadNrrd, HasTheNamesAndColoursOfSegments) {
    TemporaryFolder folder;
    const std::string keys =
        "Segment1_Name:=left: kidney \\\\ cyst\\nlarge\r\nSegment1_LabelValue:=7\r\nSegment1_Color:=1 0.5 "
        "0\r\n"
        "Segment0_LabelValue:=2\nSegment0_Color:=1 2 3\nSegment0_ID:=x\nSegment2_LabelValue:=none\n"
        "Segment0_Layer:=1\n";  // as if other layers had been left out
    const std::string space = "space: left-posterior-superior\n";
    const fs::path map =
        write_file(folder / "n.seg.nrrd", nrrd(space + "space directions: (1,0,0) (0,1,0) (0,0,1)\n" + keys) +
                                              "\n" + bytes_of(samples()));
    ScanInfo info;
    read_scan(map, {}, &info);
    ASSERT_EQ(info.series.labels.size(), 2u);
    EXPECT_EQ(info.series.labels.at(7).name, "left: kidney \\ cyst\nlarge");
    EXPECT_EQ(info.series.labels.at(7).colour, (std::array<double, 3>{1, 0.5, 0}));
    EXPECT_EQ(info.series.labels.at(2).name, "");
    EXPECT_FALSE(info.series.labels.at(2).colour);
    EXPECT_TRUE(is_segmentation(map));
    ScanOptions options;
    options.volume = 0;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(map, options)), samples());
    options.volume = 1;
    contains(refusal<OptionError>(map, options), "has no volume 1; there are 1");
    EXPECT_FALSE(is_segmentation(write_file(
        folder / "n.nrrd",
        nrrd(space + "space directions: (1,0,0) (0,1,0) (0,0,1)\n") + "\n" + bytes_of(samples()))));
}

// The header of two volumes along an axis that is the first or the last.
std::string two_volumes(bool first, const std::string& fields, const std::string& encoding = "raw") {
    std::string header = nrrd(fields, encoding);
    const std::string one = "dimension: 3\nsizes: 4 3 2";
    return header.replace(header.find(one), one.size(),
                          first ? "dimension: 4\nsizes: 2 4 3 2" : "dimension: 4\nsizes: 4 3 2 2");
}

std::vector<std::int16_t> other_samples() {
    std::vector<std::int16_t> out = samples();
    for (std::int16_t& sample : out) sample = static_cast<std::int16_t>(-3 * sample);
    return out;
}

// Two volumes, of samples() and of other_samples().
std::string interleaved(bool big_endian = false) {
    const std::vector<std::int16_t> a = samples(), b = other_samples();
    std::vector<std::int16_t> both;
    for (std::size_t i = 0; i < a.size(); ++i) both.insert(both.end(), {a[i], b[i]});
    return bytes_of(both, big_endian);
}

TEST(ReadNrrd, AVolumeIsChosenAlongTheFirstOrTheLastAxis) {
    const TemporaryFolder folder;
    const std::string space = "space: LPS\n",
                      one_after_the_other = bytes_of(samples()) + bytes_of(other_samples());
    const std::string
        list_first = "space directions: none (2,0,0) (0,3,0) (0,0,4)\nkinds: list domain domain domain\n",
        time_last = "space directions: (2,0,0) (0,3,0) (0,0,4) none\nkinds: space space space time\n";
    std::string big = two_volumes(true, space + list_first);
    big.replace(big.find("little"), 6, "big");
    write_file(folder / "data.raw", std::string(5, 'x') + interleaved());
    fs::create_directory(folder / "s");
    for (std::size_t z = 0; z < nz; ++z)
        write_file(folder / ("s/" + std::to_string(z)), interleaved().substr(z * nx * ny * 4, nx * ny * 4));
    const std::vector<fs::path> same = {
        write_file(folder / "a.nrrd", two_volumes(true, space + list_first) + "\n" + interleaved()),
        write_file(folder / "b.nrrd", big + "\n" + interleaved(true)),
        write_file(folder / "c.nrrd",
                   two_volumes(true, space + list_first, "gzip") + "\n" + gzipped(interleaved())),
        write_file(folder / "d.nhdr",
                   two_volumes(true, space + list_first + "byte skip: -1\ndata file: data.raw\n")),
        write_file(folder / "e.nhdr", two_volumes(true, space + list_first + "data file: s/%d 0 1 1\n")),
        write_file(folder / "f.nrrd",
                   two_volumes(true, space + "spacings: nan 2 3 4\n") + "\n" + interleaved()),
        write_file(folder / "g.nrrd", two_volumes(false, space + time_last) + "\n" + one_after_the_other),
        write_file(folder / "h.nrrd",
                   two_volumes(false, space + time_last, "gzip") + "\n" + gzipped(one_after_the_other)),
        write_file(folder / "i.nrrd",
                   two_volumes(false, space + "spacings: 2 3 4 nan\n") + "\n" + one_after_the_other),
    };
    for (const fs::path& path : same) {
        SCOPED_TRACE(path);
        contains(refusal<GeometryError>(path), "holds 2 volumes; choose one from 0 to 1 with options.volume");
        EXPECT_EQ(inspect_scan(path).series[0].volume_count, 2);
        ScanOptions options;
        for (std::int64_t volume = 0; volume < 2; ++volume) {
            options.volume = volume;
            const Volume read = read_scan(path, options);
            EXPECT_EQ(read.geometry().dims, (std::array<std::int64_t, 3>{nx, ny, nz}));
            EXPECT_EQ(read.geometry().spacing, (Vec3d{2, 3, 4}));
            EXPECT_EQ(samples_of<std::int16_t>(read), volume == 0 ? samples() : other_samples());
            if (path.filename() == "c.nrrd" || path.filename() == "h.nrrd") continue;  // compressed
            std::vector<std::int16_t> slice(nx * ny);
            open_slices(path, options).read(1, 2, slice.data());
            EXPECT_TRUE(std::equal(slice.begin(), slice.end(), read.samples<std::int16_t>() + nx * ny));
        }
        options.volume = 2;
        contains(refusal<OptionError>(path, options), "has no volume 2; there are 2");
    }
    const auto why = [&](const std::string& header, const std::string& data) {
        ScanOptions options;
        options.volume = 1;
        return refusal<InputError>(write_file(folder / "n.nrrd", header + "\n" + data), options);
    };
    contains(why(two_volumes(true, space + list_first), interleaved().substr(2)),
             "claims 96 bytes of samples but the file has 94");
    contains(why(two_volumes(true, space + "space directions: none (2,0,0) (0,3,0) (0,0,4)\n"
                                           "kinds: vector domain domain domain\n"),
                 interleaved()),
             "axis 0 has 2 values per point (kind 'vector')");
    contains(
        why(two_volumes(false, space + "space directions: (2,0,0) none (0,3,0) (0,0,4)\n"), interleaved()),
        "only one other is supported, as the first or the last");
}

// 3D Slicer puts segments that overlap into layers, which number their labels from 1.
TEST(ReadNrrd, LayersOfSegmentsAreVolumes) {
    const TemporaryFolder folder;
    const fs::path path = write_file(
        folder / "n.seg.nrrd",
        two_volumes(true,
                    "space: left-posterior-superior\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"
                    "kinds: list domain domain domain\n"
                    "Segment0_LabelValue:=1\nSegment0_Name:=liver\nSegment0_Layer:=0\n"
                    "Segment1_LabelValue:=1\nSegment1_Name:=tumour\nSegment1_Layer:=1\n"
                    "Segment2_LabelValue:=2\nSegment2_Layer:=1\n") +
            "\n" + interleaved());
    EXPECT_TRUE(is_segmentation(path));
    contains(refusal<GeometryError>(path), ": segments liver; segments tumour, 2");
    EXPECT_EQ(inspect_scan(path).series[0].volumes,
              (std::vector<std::string>{"segments liver", "segments tumour, 2"}));
    ScanOptions options;
    ScanInfo info;
    options.volume = 1;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(path, options, &info)), other_samples());
    ASSERT_EQ(info.series.labels.size(), 2u);
    EXPECT_EQ(info.series.labels.at(1).name, "tumour");
    EXPECT_TRUE(is_segmentation(path, options));
}

TEST(ReadNrrd, LeftHandedSpaceIsNotMirrored) {
    TemporaryFolder folder;
    ScanInfo info;
    const auto read = [&](const std::string& space) {
        return read_scan(write_file(folder / "n.nrrd",
                                    nrrd("space: " + space + "\nspacings: 2 3 4\n\n") + bytes_of(samples())),
                         {}, &info)
            .geometry();
    };
    expect_at(read("3D-left-handed"), {1, 1, 1}, {2, 3, -4});
    contains(info.warnings.at(0), "does not state the orientation");
    expect_at(read("3D-right-handed"), {1, 1, 1}, {2, 3, 4});
    contains(info.warnings.at(0), "does not state the orientation");
}

TEST(ReadGeometry, WithoutASpacingOneMustBeGivenAndOnlyThen) {
    TemporaryFolder folder;
    ScanOptions options;
    options.spacing = Vec3d{0.5, 0.5, 2};
    const fs::path bare = write_file(folder / "n.nrrd", nrrd("\n") + bytes_of(samples()));
    const fs::path bare_too = write_file(folder / "m.mha", metaimage("") + bytes_of(samples()));
    for (const auto& path : {bare, bare_too}) {
        contains(refusal<GeometryError>(path), "options.spacing");
        EXPECT_EQ(read_scan(path, options).geometry().spacing[2], 2);
    }
    const fs::path own = write_file(folder / "n.nii", nifti().header() + bytes_of(samples()));
    contains(refusal<InputError>(own, options), "states its spacing");
}

TEST(ReadGeometry, BadNumbersAreRefused) {
    TemporaryFolder folder;
    NiftiWriter zero = nifti(), negative = nifti(), infinite = nifti(), singular = nifti();
    zero.pixdim[2] = 0;
    negative.dim[2] = -3;
    infinite.pixdim[1] = INFINITY;
    singular.sform_code = 1;
    for (const auto& n : {zero, negative, infinite, singular}) {
        refusal<InputError>(write_file(folder / "n.nii", n.header() + bytes_of(samples())));
    }
    for (const char* fields :
         {"spacings: 0 1 1\n", "spacings: 1e-320 1 1\n", "spacings: 1e300 1 1\n", "spacings: 1 inf 1\n",
          "spacings: -1 1 1\n", "spacings: 1 1\n", "spacings: 1 x 1\n",
          "space: LPS\nspace directions: (1,0,0) (1,0,0) (0,0,1)\n", "space: left-up\nspacings: 1 1 1\n"}) {
        SCOPED_TRACE(fields);
        refusal<InputError>(write_file(folder / "n.nrrd", nrrd(fields) + "\n" + bytes_of(samples())));
    }
    for (const char* fields :
         {"ElementSpacing = 0 1 1\n", "ElementSpacing = 1 nan 1\n", "ElementSpacing = 1 1\n",
          "ElementSpacing = 1 1 1\nTransformMatrix = 1 0 0 1 0 0 0 0 1\n"}) {
        SCOPED_TRACE(fields);
        refusal<InputError>(write_file(folder / "m.mha", metaimage(fields) + bytes_of(samples())));
    }
}

// --- samples

TEST(ReadVolume, MoreThanOneValuePerPointIsRefused) {
    TemporaryFolder folder;
    const std::string data(4096, '\1');
    contains(refusal<InputError>(write_file(
                 folder / "b.nrrd",
                 "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 4 3 2\nencoding: raw\nspace: LPS\n"
                 "kinds: vector domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n\n" +
                     data)),
             "one value per point");
    contains(
        refusal<InputError>(write_file(
            folder / "c.mha", metaimage("ElementNumberOfChannels = 3\nElementSpacing = 1 1 1\n") + data)),
        "one value per point");
}

TEST(ReadNrrd, DataMayBeInOtherFiles) {
    TemporaryFolder folder;
    const std::string data = bytes_of(samples()), space = "spacings: 1 1 1\n";
    write_file(folder / "data.raw", data);
    write_file(folder / "later.raw", "twelve bytes" + data);
    write_file(folder / "listmode.raw", "twelve bytes" + data);
    write_file(folder / "data.raw.gz", gzipped(data));
    write_file(folder / "later.raw.gz", gzipped("twelve bytes" + data));
    write_file(folder / "sub/s07.raw", data.substr(0, data.size() / 2));
    write_file(folder / "sub/s08.raw", data.substr(data.size() / 2));
    for (std::size_t row = 0; row < ny * nz; ++row)
        write_file(folder / ("sub/row" + std::to_string(row)), data.substr(row * 2 * nx, 2 * nx));
    const std::vector<std::string> headers = {
        nrrd(space + "data file: data.raw\n"),
        nrrd(space + "datafile: ./data.raw"),  // no newline
        nrrd(space + "byte skip: 12\ndata file: later.raw\n"),
        nrrd(space + "byte skip: -1\ndata file: later.raw\n"),
        nrrd(space + "data file: data.raw.gz\n", "gzip"),
        nrrd(space + "byteskip: 12\ndata file: later.raw.gz\n", "gz"),
        nrrd(space + "data file: sub/s%02d.raw 7 8 1\n"),
        nrrd(space + "data file: sub/s%02d.raw 7 8 1 2\n"),
        nrrd(space + "data file: sub/row%d 0 5 1 1\n"),  // each file holds one axis
        nrrd(space + "data file: LIST\nsub/s07.raw\nsub/s08.raw\n"),
        nrrd(space + "data file: list 2\nsub/s07.raw\nsub/s08.raw\n"),
        nrrd(space + "data file: listmode.raw\nbyte skip: 12\n"),
    };
    for (const auto& header : headers) {
        SCOPED_TRACE(header);
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(write_file(folder / "n.nhdr", header))), samples());
    }
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(
                  write_file(folder / "n.nrrd", nrrd(space + "key:=value\r\n\n", "gzip") + gzipped(data)))),
              samples());
    for (const char* encoding : {"ascii", "hex", "bzip2"}) {
        contains(refusal<InputError>(
                     write_file(folder / "n.nhdr", nrrd(space + "data file: data.raw\n", encoding))),
                 encoding);
    }
    contains(refusal<IoError>(write_file(folder / "n.nhdr", nrrd(space + "data file: missing.raw\n"))),
             "missing.raw");
}

TEST(ReadNrrd, ImpossibleNumbersOfFilesAreRefused) {
    TemporaryFolder folder;
    for (const char* numbers : {"1 -9223372036854775807 -1", "-9223372036854775807 9223372036854775807 1",
                                "0 1 9223372036854775807", "-9223372036854775808 -9223372036854775808 -1",
                                "1 0 1", "0 1 0", "1 2 1"}) {
        const std::string sizes =
            "sizes: 1 1 " + std::string(numbers[0] == '1' && numbers[2] == '2' ? "1" : "2");
        contains(refusal<InputError>(write_file(
                     folder / "n.nhdr", "NRRD0004\ntype: uchar\ndimension: 3\n" + sizes +
                                            "\nspacings: 1 1 1\nencoding: raw\ndata file: s%03d.raw " +
                                            numbers + "\n")),
                 "no valid range of numbers");
    }
    contains(refusal<InputError>(
                 write_file(folder / "n.nhdr",
                            "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 9000000000000000\nspacings: 1 "
                            "1 1\nencoding: raw\ndata file: s%03d.raw 1 900000000 1\n")),
             "no valid range of numbers");
}

TEST(ReadNrrd, MuMayBeGreek) {
    TemporaryFolder folder;
    for (const std::string mu : {"\xc2\xb5", "\xce\xbc"}) {
        const std::string unit = "\"" + mu + "m\"";
        const Volume volume = read_scan(write_file(
            folder / "n.nrrd", nrrd("spacings: 1 1 1\nunits: " + unit + " " + unit + " " + unit + "\n\n") +
                                   bytes_of(samples())));
        EXPECT_DOUBLE_EQ(volume.geometry().spacing[0], 1e-3);
    }
}

TEST(ReadMetaImage, DataMayBeInOtherFiles) {
    TemporaryFolder folder;
    const std::string data = bytes_of(samples()), space = "ElementSpacing = 1 1 1\n";
    write_file(folder / "data.raw", data);
    write_file(folder / "later.raw", "twelve bytes" + data);
    write_file(folder / "listmode.raw", data);
    write_file(folder / "data.zraw", deflated(data, 15));
    write_file(folder / "s1", data.substr(0, data.size() / 2));
    write_file(folder / "s2", data.substr(data.size() / 2));
    for (const auto& header :
         {metaimage(space, "data.raw"), metaimage(space + "HeaderSize = 12\n", "later.raw"),
          metaimage(space + "HeaderSize = -1\n", "later.raw"),
          metaimage(space + "CompressedData = True\n", "data.zraw"), metaimage(space, "LIST\ns1\ns2"),
          metaimage(space, "listmode.raw")}) {
        SCOPED_TRACE(header);
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(write_file(folder / "m.mhd", header))), samples());
    }
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(write_file(
                  folder / "m.mha", metaimage(space + "CompressedData = True\n") + deflated(data, 15)))),
              samples());
    contains(refusal<InputError>(
                 write_file(folder / "m.mhd", metaimage(space + "BinaryData = False\n", "data.raw"))),
             "text");
    // A size counts from the beginning of the file, which holds the header too.
    const std::size_t end = metaimage(space + "HeaderSize = 999\n").size();
    const std::string header = metaimage(space + "HeaderSize = " + std::to_string(end + 12) + "\n");
    ASSERT_EQ(header.size(), end);
    EXPECT_EQ(
        samples_of<std::int16_t>(read_scan(write_file(folder / "m.mha", header + "twelve bytes" + data))),
        samples());
    contains(refusal<InputError>(write_file(folder / "m.mha",
                                            metaimage(space + "HeaderSize = 9223372036854775807\n") + data)),
             "truncated");
    contains(refusal<InputError>(write_file(folder / "m.mha", metaimage(space + "HeaderSize = 10\n") + data)),
             "within the header");
}

TEST(ReadMetaImage, DistancesAreInTheUnitThatIsStated) {
    TemporaryFolder folder;
    const std::string data = bytes_of(samples());
    for (const auto& [unit, mm] : {std::pair{"mm", 1.0}, {"cm", 10.0}, {"um", 0.001}}) {
        SCOPED_TRACE(unit);
        const std::string space = "DistanceUnits = "s + unit + "\nElementSpacing = 1 2 3\nOffset = 4 5 6\n";
        const Geometry geometry = read_scan(write_file(folder / "m.mha", metaimage(space) + data)).geometry();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto number = static_cast<double>(axis);
            EXPECT_DOUBLE_EQ(geometry.spacing[axis], (1 + number) * mm);
            EXPECT_DOUBLE_EQ(geometry.origin[axis], (4 + number) * mm);
        }
    }
}

TEST(ReadMetaImage, BothKeysStateTheByteOrder) {
    TemporaryFolder folder;
    std::string data = bytes_of(samples());
    for (std::size_t i = 0; i < data.size(); i += 2) std::swap(data[i], data[i + 1]);
    for (const char* key : {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) {
        SCOPED_TRACE(key);
        std::string header = metaimage("ElementSpacing = 1 1 1\n");
        const std::string stated = "BinaryDataByteOrderMSB = False";
        header.replace(header.find(stated), stated.size(), key + " = True"s);
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(write_file(folder / "m.mha", header + data))),
                  samples());
    }
}

TEST(ReadVolume, DataOutsideTheHeadersFolderAreRefused) {
    TemporaryFolder folder;
    const fs::path outside = write_file(folder / "secret.raw", bytes_of(samples()));
    fs::create_directories(folder / "in/sub");
    fs::create_symlink(outside, folder / "in/link.raw");
    fs::create_directory_symlink(folder.path(), folder / "in/linked");
    for (const std::string& name : {"../secret.raw"s, outside.string(), "sub/../../secret.raw"s, "link.raw"s,
                                    "linked/secret.raw"s, "linked/missing.raw"s}) {
        SCOPED_TRACE(name);
        const std::string why = name.starts_with("link")
                                    ? "leads out of the header's folder by a symbolic link"
                                    : "not in the header's folder";
        contains(refusal<InputError>(
                     write_file(folder / "in/n.nhdr", nrrd("spacings: 1 1 1\ndata file: " + name + "\n"))),
                 why);
        contains(refusal<InputError>(write_file(folder / "in/n.nhdr",
                                                nrrd("spacings: 1 1 1\ndata file: LIST\n" + name + "\n"))),
                 why);
        contains(
            refusal<InputError>(write_file(folder / "in/m.mhd", metaimage("ElementSpacing = 1 1 1\n", name))),
            why);
    }
}

TEST(ReadVolume, ClaimsBeyondTheFileAreRefusedAtOnce) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    n.dim = {3, 10000, 10000, 10000};
    const std::string some(100, '\0');
    const std::string sizes = "sizes: 10000 10000 10000\n";
    const std::vector<fs::path> files = {
        write_file(folder / "a.nii", n.header() + some),
        write_file(folder / "a.nii.gz", gzipped(n.header() + some)),
        write_file(folder / "b.nrrd",
                   "NRRD0004\ntype: short\ndimension: 3\nendian: little\nspacings: 1 1 1\nencoding: raw\n" +
                       sizes + "\n" + some),
        write_file(folder / "c.nrrd",
                   "NRRD0004\ntype: short\ndimension: 3\nendian: little\nspacings: 1 1 1\nencoding: gzip\n" +
                       sizes + "\n" + gzipped(some)),
        write_file(folder / "d.nrrd",
                   "NRRD0004\ntype: short\ndimension: 3\nendian: little\nspacings: 1 1 1\nencoding: "
                   "raw\nsizes: 4000000000000000 4000000000000000 4000000000000000\n\n" +
                       some),
        write_file(folder / "e.mha",
                   "ObjectType = Image\nNDims = 3\nDimSize = 10000 10000 10000\nElementSpacing = 1 1 "
                   "1\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
                       some)};
    for (const auto& path : files) {
        SCOPED_TRACE(path.filename());
        contains(refusal<InputError>(path), "claims");
    }
}

// A file may be longer than its samples and yet lack some, because they do not begin at its start.
TEST(ReadVolume, MessagesOfTruncatedFilesCountWhatFollowsTheHeader) {
    TemporaryFolder folder;
    const std::string space = "spacings: 1 1 1\n", data = bytes_of(samples());
    ASSERT_EQ(data.size(), 48u);
    const auto why = [&](const std::string& header, const std::string& bytes) {
        return refusal<InputError>(write_file(folder / "n.nrrd", header + "\n" + bytes));
    };
    contains(why(nrrd(space + "byte skip: 100\n"), std::string(100, '\0') + data.substr(0, 40)),
             "claims 48 bytes of samples but the file has 40;");
    contains(why(nrrd(space + "byte skip: 100\n"), data), "claims 48 bytes of samples but the file has 0;");
    contains(why(nrrd(space + "byte skip: 1000000\n", "gzip"), gzipped(data)),
             "claims 48 bytes of samples but the file can hold at most 0;");
}

// --- invalid input

TEST(ReadScan, MissingEmptyAndOtherFilesAreRefused) {
    TemporaryFolder folder;
    contains(refusal<IoError>(folder / "nothing.nii"), "no such file");
    fs::create_directory(folder / "empty");
    contains(refusal<InputError>(folder / "empty"), "no files");
    contains(refusal<InputError>(write_file(folder / "letter.nii", "Dear colleague")), "not a NIfTI file");
    contains(refusal<InputError>(write_file(folder / "letter.nrrd", "Dear colleague")), "not a NRRD file");
    contains(refusal<InputError>(write_file(folder / "5d.nrrd",
                                            "NRRD0004\ntype: uchar\ndimension: 5\nsizes: 2 2 2 3 2\n"
                                            "encoding: raw\n\n" +
                                                std::string(48, '\0'))),
             "besides three axes of space, only one other is supported");
    contains(refusal<InputError>(write_file(folder / "letter.mha", "Dear colleague")),
             "not a MetaImage file");
    contains(refusal<InputError>(write_file(folder / "letter.txt", "Dear colleague")), "not a scan");
    contains(refusal<InputError>(write_file(folder / "zero.nii", "")), "not a NIfTI file");
    refusal<IoError>("/dev/null");
    EXPECT_THROW(inspect_scan(folder / "nothing.nii"), IoError);
}

TEST(ReadScan, NamesInMessagesAreEscaped) {
    TemporaryFolder folder;
    contains(refusal<InputError>(write_file(folder / "a\nb\x1b[31m.nii", "no")), "a\\x0ab\\x1b[31m.nii");
}

TEST(ReadScan, NamesInMessagesAreValidUtf8) {
    TemporaryFolder folder;
    contains(refusal<InputError>(write_file(folder / "sch\xe4"
                                                     "del.nii",
                                            "no")),
             "sch\\xe4del.nii");
    contains(refusal<InputError>(write_file(folder / "sch\xc3\xa4"
                                                     "del.nii",
                                            "no")),
             "sch\xc3\xa4"
             "del.nii");
    // Wherever a long name loses its middle, its characters are whole.
    for (std::size_t shift = 0; shift < 3; ++shift) {
        std::string name(shift, 'a');
        for (int i = 0; i < 70; ++i) name += "\xe9\xa0\xad";
        std::string message = refusal<InputError>(write_file(folder / (name + ".nii"), "no"));
        for (std::size_t at; (at = message.find("\xe9\xa0\xad")) != message.npos;) message.erase(at, 3);
        EXPECT_TRUE(std::all_of(message.begin(), message.end(), [](char c) { return c > 0; })) << message;
        contains(message, "...");
    }
}

TEST(InspectScan, NeedsNoSamples) {
    TemporaryFolder folder;
    const ScanReport report = inspect_scan(write_file(folder / "n.nii", nifti().header()));
    ASSERT_EQ(report.series.size(), 1u);
    EXPECT_EQ(report.format, ScanFormat::nifti);
    EXPECT_EQ(report.series[0].series.dims, (std::array<std::int64_t, 3>{nx, ny, nz}));
}

TEST(ReadScan, TruncatedAnywhereIsNeverReadAndNothingIsPrinted) {
    TemporaryFolder folder;
    const std::string data = bytes_of(samples());
    const std::vector<std::pair<fs::path, std::string>> files = {
        {folder / "a.nii", nifti().header() + data},
        {folder / "b.nii.gz", gzipped(nifti().header() + data)},
        {folder / "c.nrrd", nrrd("spacings: 1 1 1\n\n") + data},
        {folder / "d.nrrd", nrrd("spacings: 1 1 1\n\n", "gzip") + gzipped(data)},
        {folder / "e.mha", metaimage("ElementSpacing = 1 1 1\n") + data},
        {folder / "f.mha", metaimage("ElementSpacing = 1 1 1\nCompressedData = True\n") + deflated(data, 15)},
        {folder / "g.png", png(4, 3, std::vector<std::uint16_t>(12, 500))},
        {folder / "h.tif", tiff(3, 2, {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 10, 11, 12}})}};
    testing::internal::CaptureStderr();
    for (const auto& [path, whole] : files) {
        SCOPED_TRACE(path.filename());
        const bool picture = (path.extension() == ".png") || (path.extension() == ".tif");
        ScanOptions options;
        if (picture) options.spacing = Vec3d{1, 1, 1};
        EXPECT_NO_THROW(read_scan(write_file(path, whole), options));
        const std::size_t marks =
            (path.extension() == ".png") ? 16 : 0;  // a checksum and an end mark follow the pixels of a PNG
        for (std::size_t size = 0; size + marks < whole.size(); ++size) {
            write_file(path, whole.substr(0, size));
            EXPECT_THROW(read_scan(path, options), Error) << size << " of " << whole.size();
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ReadScan, FlippedBytesNeverCrash) {
    TemporaryFolder folder;
    std::uint32_t random = 7;
    const auto next = [&] { return random = random * 1664525u + 1013904223u; };
    const std::string data = bytes_of(samples());
    const std::vector<std::pair<fs::path, std::string>> files = {
        {folder / "a.nii", nifti().header() + data},
        {folder / "b.nii.gz", gzipped(nifti().header() + data)},
        {folder / "c.nrrd", nrrd("space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: "
                                 "(1,2,3)\nkinds: domain domain domain\n\n") +
                                data},
        {folder / "e.mha",
         metaimage("ElementSpacing = 1 1 1\nOffset = 1 2 3\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n") + data},
        {folder / "g.png", png(4, 3, std::vector<std::uint16_t>(12, 500))},
        {folder / "h.tif", tiff(3, 2, {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 10, 11, 12}})}};
    testing::internal::CaptureStderr();
    for (const auto& [path, whole] : files) {
        SCOPED_TRACE(path.filename());
        for (int n = 0; n < 500; ++n) {
            std::string bytes = whole;
            for (int flip = 0; flip < 2; ++flip)
                bytes[next() / 16 % bytes.size()] = static_cast<char>(next() >> 24);
            write_file(path, bytes);
            try {
                ScanOptions options;
                if (n % 2) options.spacing = Vec3d{1, 1, 1};
                read_scan(path, options);
            } catch (const Error&) {  // any other exception fails the test
            }
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ReadScan, RawFilesReportProgressAndStop) {
    TemporaryFolder folder;
    NiftiWriter n;
    n.dim = {3, 128, 128, 200};
    const fs::path path =
        write_file(folder / "n.nii", n.header() + std::string(std::size_t{2} * 128 * 128 * 200, '\1'));
    int calls = 0;
    ScanOptions options;
    options.progress = [&](double) { return ++calls < 3; };
    EXPECT_THROW(read_scan(path, options), Cancelled);
    EXPECT_EQ(calls, 3);
}

// The bytes that this process has read from files.
std::uint64_t bytes_read() {
    std::ifstream counts("/proc/self/io");
    std::string name;
    std::uint64_t count = 0;
    while (counts >> name >> count && name != "rchar:") {
    }
    return count;
}

TEST(ReadScan, AVolumeBehindOthersIsReachedWithoutReadingThem) {
    TemporaryFolder folder;
    NiftiWriter n = nifti();
    constexpr std::int16_t kBefore = 30'000;
    n.dim = {4, nx, ny, nz, std::int16_t{kBefore + 1}};
    const std::string data = bytes_of(samples());
    const std::string bytes = n.header() + std::string(kBefore * data.size(), '\1') + data;
    ScanOptions options;
    options.volume = kBefore;
    const fs::path path = write_file(folder / "n.nii", bytes);
    const std::uint64_t before = bytes_read();
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(path, options)), samples());
    if (before > 0) {  // the system counts what is read
        EXPECT_LT(bytes_read() - before, 100'000u);
    }

    // Compressed, they are passed over with progress.
    const fs::path compressed = write_file(folder / "n.nii.gz", gzipped(bytes));
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(compressed, options)), samples());
    std::vector<double> fractions;
    options.progress = [&](double fraction) {
        fractions.push_back(fraction);
        return fraction < 0.5;
    };
    EXPECT_THROW(read_scan(compressed, options), Cancelled);
    EXPECT_EQ(fractions.size(), 2u);
    EXPECT_LT(fractions.back(), 1);
}

// Reads a file as a whole and slice by slice.
void expect_same_slices(const fs::path& file) {
    const Volume whole = read_scan(file);
    const SliceSource source = open_slices(file);
    EXPECT_EQ(source.geometry.dims, whole.geometry().dims);
    EXPECT_EQ(source.geometry.origin, whole.geometry().origin);
    ASSERT_EQ(source.type, whole.type());
    const std::int64_t nz = whole.geometry().dims[2];
    const std::size_t slice = whole.bytes() / static_cast<std::size_t>(nz);
    for (std::int64_t begin = 0; begin < nz; ++begin) {
        for (std::int64_t end = begin + 1; end <= nz; ++end) {
            std::string bytes(slice * static_cast<std::size_t>(end - begin), '\0');
            source.read(begin, end, bytes.data());
            EXPECT_EQ(
                std::memcmp(bytes.data(),
                            static_cast<const char*>(whole.data()) + slice * static_cast<std::size_t>(begin),
                            bytes.size()),
                0);
        }
    }
}

TEST(OpenSlices, GivesTheSamplesOfReadScan) {
    TemporaryFolder folder;
    std::vector<std::int16_t> samples(5 * 4 * 6);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::int16_t>(i * 771);
    const std::string header =
        "NRRD0005\ntype: int16\ndimension: 3\nsizes: 5 4 6\nspace: left-posterior-superior\n"
        "space directions: (1,0,0) (0,1,0) (0,0,2)\nspace origin: (1,2,3)\n";
    for (const bool big : {false, true}) {
        const std::string endian = big ? "endian: big\n" : "endian: little\n";
        expect_same_slices(
            write_file(folder / "a.nrrd", header + endian + "encoding: raw\n\n" + bytes_of(samples, big)));
        // Two slices in each file.
        for (int part = 0; part < 3; ++part) {
            const std::vector<std::int16_t> share(samples.begin() + 40 * part,
                                                  samples.begin() + 40 * (part + 1));
            write_file(folder / ("part" + std::to_string(part)), bytes_of(share, big));
        }
        expect_same_slices(write_file(
            folder / "b.nhdr", header + endian + "encoding: raw\ndata file: LIST\npart0\npart1\npart2\n"));
    }
    const fs::path compressed = write_file(
        folder / "c.nrrd", header + "endian: little\nencoding: gzip\n\n" + gzipped(bytes_of(samples)));
    EXPECT_THROW(open_slices(compressed), InputError);
    EXPECT_THROW(open_slices(write_file(folder / "d.png", png<std::uint8_t>(2, 2, {1, 2, 3, 4}))),
                 InputError);
}

}  // namespace
}  // namespace marrow::test
