// DICOM segmentations as label maps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <marrow/error.h>
#include <marrow/labels.h>

#include "support/dicom_objects.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

using Labels = std::vector<std::uint8_t>;

TEST(DicomSegmentation, BinarySegmentsAreLabelsWithNamesAndColours) {
    TemporaryFolder folder;
    // The frames are in no order, 6 bits each, and the slice at 0.25 is missing.
    segmentation({{2, 0.5, {0, 0, 1, 0, 1, 1}}, {1, 0, {1, 1, 0, 0, 0, 1}}, {1, 0.5, {1, 0, 0, 1, 0, 0}}},
                 "BINARY")
        .write(folder / "seg.dcm");
    ScanInfo info;
    const Volume v = read_scan(folder / "seg.dcm", {}, &info);
    EXPECT_EQ(samples_of<std::uint8_t>(v), (Labels{1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 2, 1, 2, 2}));
    expect_at(v.geometry(), {1, 1, 2}, {14, 23, 0.5});
    ASSERT_EQ(info.series.labels.size(), 2u);
    EXPECT_EQ(info.series.labels.at(2).name, "left kidney");
    // Lab 50, 0, 0 is a grey of 119 in sRGB; the other is red.
    for (const double c : *info.series.labels.at(2).colour) EXPECT_NEAR(c * 255, 119, 1);
    const auto red = *info.series.labels.at(1).colour;
    EXPECT_GT(red[0], red[1] + 0.5);
    EXPECT_GT(red[0], red[2] + 0.5);
    EXPECT_TRUE(is_segmentation(folder / "seg.dcm"));
    const ScanReport report = inspect_scan(folder / "seg.dcm");
    EXPECT_EQ(report.series.at(0).series.labels.size(), 2u);
    EXPECT_TRUE(report.chosen);
}

TEST(DicomSegmentation, WarnsOfSlicesThatMayBeMissing) {
    TemporaryFolder folder;
    const auto warning = [&](const std::vector<double>& at, const std::string& between,
                             const std::string& thickness, double spacing) {
        std::vector<SegmentFrame> frames;
        for (const double z : at) frames.push_back({1, z, {1, 1, 1, 0, 0, 0}});
        segmentation(frames, "BINARY", between, thickness).write(folder / "seg.dcm");
        ScanInfo info;
        EXPECT_NEAR(read_scan(folder / "seg.dcm", {}, &info).geometry().spacing[2], spacing, 1e-9);
        EXPECT_LE(info.warnings.size(), 1u);
        return info.warnings.empty() ? "" : info.warnings.front();
    };
    contains(warning({0, 8, 16}, "", "2", 8), "slices between them may be missing");
    contains(warning({0, 2, 4}, "1", "1", 1), "the slices between them are empty");
    EXPECT_EQ(warning({0, 2, 4}, "", "2", 2), "");
    EXPECT_EQ(warning({0, 2, 4}, "", "1.5", 2), "") << "thinner than the distance, which is common";
    EXPECT_EQ(warning({0, 2, 4}, "", "", 2), "");
    EXPECT_EQ(warning({0, 2, 8}, "2", "1", 2), "") << "some frames are beside each other";
    EXPECT_EQ(warning({0}, "2", "1", 2), "");
}

TEST(DicomSegmentation, SegmentsThatOverlapAreSeveralMaps) {
    TemporaryFolder folder;
    segmentation({{1, 0, {1, 1, 0, 0, 0, 0}}, {2, 0, {0, 1, 1, 0, 0, 0}}, {3, 0, {0, 0, 0, 0, 1, 1}}},
                 "BINARY")
        .write(folder / "seg.dcm");
    const std::string what = refusal<GeometryError>(folder / "seg.dcm");
    contains(what, "2 label maps (0: segments 1, 3; 1: segments 2)");
    contains(what, "options.volume");
    ScanOptions options;
    options.volume = 0;
    ScanInfo info;
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "seg.dcm", options, &info)),
              (Labels{1, 1, 0, 0, 3, 3}));
    EXPECT_EQ(info.volumes, 2);
    options.volume = 1;
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "seg.dcm", options)), (Labels{0, 2, 2, 0, 0, 0}));
    options.volume = 2;
    contains(refusal<OptionError>(folder / "seg.dcm", options), "has no volume 2");
}

// Few frames, far apart, make many slices, and each segment that overlaps another a map of them.
TEST(DicomSegmentation, TooManyMapsForTheFramesAreRefused) {
    TemporaryFolder folder;
    constexpr int kSide = 300;
    std::vector<SegmentFrame> frames{{1, 499.75, std::vector<std::uint8_t>(6, 1)}};
    for (int segment = 1; segment <= 2; ++segment)
        frames.push_back({segment, 0, std::vector<std::uint8_t>(6, 1)});
    DicomWriter file = segmentation(frames, "FRACTIONAL");
    file.pixels(kSide, kSide, std::vector<std::uint8_t>(frames.size() * kSide * kSide, 255));
    file.text(0x00280008, "IS", std::to_string(frames.size()));
    file.write(folder / "seg.dcm");
    contains(refusal<LimitError>(folder / "seg.dcm"), "2 label maps");
}

TEST(DicomSegmentation, IsToldFromScansInAFolderToo) {
    TemporaryFolder folder;
    write_series(folder, 3, "scan/s");
    fs::create_directory(folder / "alone");
    for (const auto& file : {folder / "alone" / "seg.dcm", folder / "scan" / "seg.dcm"})
        segmentation({{1, 0, {1, 1, 0, 0, 0, 0}}, {1, 0.5, {0, 1, 1, 0, 0, 0}}}, "BINARY").write(file);
    EXPECT_TRUE(is_segmentation(folder / "alone"));
    EXPECT_TRUE(is_segmentation(folder / "scan" / "seg.dcm"));
    EXPECT_THROW(is_segmentation(folder / "scan"), GeometryError) << "one of two series must be chosen";
    const ScanReport report = inspect_scan(folder / "scan");
    ASSERT_EQ(report.series.size(), 2u);
    for (std::size_t s = 0; s < 2; ++s) {
        ScanOptions options;
        options.series = std::to_string(s + 1);
        EXPECT_EQ(is_segmentation(folder / "scan", options), report.series[s].series.modality == "SEG") << s;
    }
    EXPECT_THROW(is_segmentation(folder / "missing"), IoError);
    ScanOptions stopped;
    stopped.progress = [](double) { return false; };
    EXPECT_THROW(is_segmentation(folder / "alone", stopped), Cancelled);
}

TEST(DicomSegmentation, FractionsCountFromHalfOfTheLargest) {
    TemporaryFolder folder;
    DicomWriter s =
        segmentation({{1, 0, {0, 49, 50, 51, 100, 99}}, {2, 0.25, {100, 0, 0, 0, 0, 50}}}, "FRACTIONAL");
    s.number(0x0062000e, 100);
    s.write(folder / "seg.dcm");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "seg.dcm", {}, &info)),
              (Labels{0, 0, 1, 1, 1, 1, 2, 0, 0, 0, 0, 2}));
    contains(info.warnings.at(0), "cut at half");
}

TEST(DicomSegmentation, StoredLabelMaps) {
    TemporaryFolder folder;
    DicomWriter s = segmentation({{0, 0, {0, 1, 2, 200, 0, 0}}, {0, 0.25, {0, 0, 0, 1, 1, 2}}}, "LABELMAP");
    s.write(folder / "seg.dcm");
    EXPECT_EQ(samples_of<std::uint8_t>(read_scan(folder / "seg.dcm")),
              (Labels{0, 1, 2, 200, 0, 0, 0, 0, 0, 1, 1, 2}));
    s.pixel_format(16, 16, false);
    s.pixels<std::uint16_t>(columns, rows, {0, 1, 2, 60000, 0, 0, 0, 0, 0, 1, 1, 2});
    s.write(folder / "seg.dcm");
    EXPECT_EQ(samples_of<std::uint16_t>(read_scan(folder / "seg.dcm"))[3], 60000);
}

TEST(DicomSegmentation, FramesThatAreNotOnOneGridAreRefused) {
    const std::vector<std::uint8_t> some{0, 1, 1, 0, 0, 0};
    const std::vector<std::pair<const char*, DicomWriter>> cases = {
        {"not on the grid", segmentation({{1, 0, some}, {1, 0.6, some}, {1, 1.0, some}}, "BINARY")},
        {"would have", segmentation({{1, 0, some}, {1, 1e6, some}}, "BINARY")},
        {"does not name its segment", segmentation({{0, 0, some}}, "BINARY")}};
    for (const auto& [part, s] : cases) {
        SCOPED_TRACE(part);
        TemporaryFolder folder;
        s.write(folder / "seg.dcm");
        contains(refusal<InputError>(folder / "seg.dcm"), part);
    }
    // As for several times; segments of different numbers may be at one place.
    for (const char* type : {"BINARY", "FRACTIONAL", "LABELMAP"}) {
        TemporaryFolder folder;
        segmentation({{1, 0, some}, {2, 0.25, some}, {2, 0, some}, {1, 0, some}}, type)
            .write(folder / "seg.dcm");
        contains(refusal<GeometryError>(folder / "seg.dcm"),
                 std::string("frames 1 and ") + (std::string(type) == "LABELMAP" ? "3" : "4") +
                     " of the segmentation are at the same place");
    }
    TemporaryFolder folder;
    DicomWriter s = segmentation({{1, 0, some}}, "BINARY");
    s.elements.erase(0x52009229);
    s.write(folder / "seg.dcm");
    contains(refusal<InputError>(folder / "seg.dcm"), "does not state position, orientation and spacing");
    s = segmentation({{1, 0, some}, {1, 0.25, some}}, "BINARY");
    s.elements[0x7fe00010].second = "a";
    s.write(folder / "seg.dcm");
    contains(refusal<InputError>(folder / "seg.dcm"), "truncated");
}

// The same label maps as the NRRD files that they were made from, with the same surfaces.
TEST(ReadReal, SegmentationsAreTheLabelMapsOfTheNrrd) {
    MARROW_TEST_SCAN(folder, "n_dicom_seg");
    struct Case {
        const char *dicom, *nrrd;
        std::int64_t volume;
    };
    for (const Case& c : {Case{"liver.dcm", "liver_seg.nrrd", 0},
                          Case{"sparse-labelmap-noppv.dcm", "sparse_labelmap_noppv_seg.nrrd", 0},
                          Case{"partial_overlaps.dcm", "partial_overlaps-1.nrrd", 0},
                          Case{"partial_overlaps.dcm", "partial_overlaps-2.nrrd", 1},
                          Case{"partial_overlaps.dcm", "partial_overlaps-3.nrrd", 2}}) {
        SCOPED_TRACE(c.nrrd);
        ScanOptions options;
        options.volume = c.volume;
        ScanInfo info;
        const Volume a = read_scan(folder / c.dicom, options, &info), b = read_scan(folder / c.nrrd);
        if (std::string(c.dicom) == "liver.dcm") {
            const auto colour = info.series.labels.at(1).colour.value();
            for (std::size_t i = 0; i < 3; ++i)  // as 3D Slicer defines it
                EXPECT_EQ(std::lround(255 * colour[i]), (std::array<long, 3>{221, 130, 101})[i]);
        }
        ASSERT_EQ(a.geometry().dims, b.geometry().dims);
        const auto x = samples_of<std::uint8_t>(a);
        const auto y = samples_of<std::int16_t>(b);
        EXPECT_TRUE(std::equal(x.begin(), x.end(), y.begin(), y.end()));
        const auto from_dicom = extract_labels(a), from_nrrd = extract_labels(b);
        ASSERT_EQ(from_dicom.size(), from_nrrd.size());
        for (std::size_t i = 0; i < from_dicom.size(); ++i) {
            EXPECT_EQ(from_dicom[i].label, from_nrrd[i].label);
            const Mesh &m = from_dicom[i].mesh, &n = from_nrrd[i].mesh;
            EXPECT_EQ(m.triangles, n.triangles);
            ASSERT_EQ(m.points.size(), n.points.size());
            for (std::size_t p = 0; p < m.points.size(); ++p) {
                for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(m.points[p][axis], n.points[p][axis], 1e-3);
            }
        }
    }
}

}  // namespace
}  // namespace marrow::test
