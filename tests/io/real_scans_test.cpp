// Real scans, if MARROW_TEST_DATA names a folder with them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/vector.h>

#include "support/reading_checks.h"
#include "support/scan_files.h"

namespace marrow::test {
namespace {

double farthest_corner(const Geometry& a, const Geometry& b) {
    double out = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d index;
        for (int axis = 0; axis < 3; ++axis)
            index[axis] = corner >> axis & 1 ? static_cast<double>(a.dims[axis] - 1) : 0;
        const Vec3d p = a.physical(index), q = b.physical(index);
        out = std::max(out, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
    }
    return out;
}

// The NRRD header names a left-handed space and lists the slices from the top: the same head is 92 slices
// higher.
TEST(ReadReal, SmallHeadIsTheSameInDicomAndNrrd) {
    MARROW_TEST_SCAN(dicom, "slicer_cthead_dcm");
    MARROW_TEST_SCAN(nrrd, "vtk_headsq/vtk_headsq/headsq/quarter.nhdr");
    const Volume a = read_scan(dicom), b = read_scan(nrrd);
    const auto x = samples_of<std::int16_t>(a), y = samples_of<std::int16_t>(b);
    ASSERT_EQ(x.size(), y.size());
    const std::size_t area = 64 * 64, slices = 93;
    for (std::size_t k = 0; k < slices; ++k) {
        const auto from = x.begin() + static_cast<std::ptrdiff_t>(k * area);
        EXPECT_TRUE(
            std::equal(from, from + area, y.begin() + static_cast<std::ptrdiff_t>((slices - 1 - k) * area)))
            << k;
        for (const auto& [i, j] : {std::pair(0, 0), std::pair(63, 0), std::pair(7, 63)}) {
            const auto u = static_cast<double>(i), v = static_cast<double>(j);
            const Vec3d p = a.geometry().physical({u, v, static_cast<double>(k)});
            expect_at(b.geometry(), {u, v, static_cast<double>(slices - 1 - k)},
                      {p[0], p[1], p[2] - 92 * 1.5}, 1e-3);
        }
    }
}

// Every point of one surface is within 1e-3 mm of a point of the other.
void expect_points_among(const Mesh& points, const Mesh& others, float shift_z) {
    using Cell = std::array<long, 3>;
    const auto cell_of = [](const Vec3f& p) {
        return Cell{std::lround(p[0] * 500), std::lround(p[1] * 500), std::lround(p[2] * 500)};
    };
    std::multimap<Cell, Vec3f> cells;
    for (const Vec3f& p : others.points) cells.emplace(cell_of(p), p);
    for (Vec3f p : points.points) {
        p[2] += shift_z;
        const Cell c = cell_of(p);
        double nearest = 1;
        for (int n = 0; n < 27; ++n) {
            const auto [begin, end] =
                cells.equal_range({c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1});
            for (auto q = begin; q != end; ++q) {
                nearest = std::min<double>(
                    nearest, std::hypot(p[0] - q->second[0], p[1] - q->second[1], p[2] - q->second[2]));
            }
        }
        ASSERT_LE(nearest, 1e-3);
    }
}

TEST(ReadReal, SmallHeadGivesTheSamePointsInDicomAndNrrd) {
    MARROW_TEST_SCAN(dicom, "slicer_cthead_dcm");
    MARROW_TEST_SCAN(nrrd, "vtk_headsq/vtk_headsq/headsq/quarter.nhdr");
    const Volume a = read_scan(dicom), b = read_scan(nrrd);
    const Mesh from_dicom = extract_isosurface(a, 1150.5), from_nrrd = extract_isosurface(b, 1150.5);
    ASSERT_GT(from_dicom.points.size(), 10000u);
    ASSERT_EQ(from_dicom.points.size(), from_nrrd.points.size());
    expect_points_among(from_dicom, from_nrrd, -92 * 1.5f);
    expect_points_among(from_nrrd, from_dicom, 92 * 1.5f);
}

TEST(ReadReal, HeadAndFeetUnderOneSeriesNumberAreTwoVolumes) {
    MARROW_TEST_SCAN(head, "vhf_head_ct");
    MARROW_TEST_SCAN(feet, "vhf_ankle_ct");
    TemporaryFolder folder;
    fs::copy(head, folder / "a", fs::copy_options::recursive);
    fs::copy(feet, folder / "b", fs::copy_options::recursive);
    const auto series = inspect_scan(folder.path()).series;
    ASSERT_EQ(series.size(), 2u);
    EXPECT_EQ(series[0].series.dims[2], 234);
    EXPECT_EQ(series[1].series.dims[2], 150);
    contains(refusal<GeometryError>(folder.path()), "2 series");
    ScanOptions options;
    options.series = series[1].series.id;
    EXPECT_EQ(read_scan(folder.path(), options).geometry().dims[2], 150);
}

TEST(ReadReal, TiltedScanWithGapsIsRefused) {
    MARROW_TEST_SCAN(scan, "qa_ct_ge_tilt");
    contains(refusal<GeometryError>(scan), "uneven");
}

TEST(ReadReal, TiltedScanWithGapsIsResampled) {
    MARROW_TEST_SCAN(scan, "qa_ct_ge_tilt");
    ScanOptions options;
    options.resample = true;
    ScanInfo info;
    const Geometry g = read_scan(scan, options, &info).geometry();
    EXPECT_EQ(g.dims[2], 37);
    const double along = g.direction[1][1] * g.direction[1][2] + g.direction[2][1] * g.direction[2][2];
    EXPECT_NEAR(std::abs(along), std::sin(18.5 * M_PI / 180), 1e-3);
    ASSERT_EQ(info.warnings.size(), 2u);
    contains(info.warnings[0], "tilted by 18.5 degrees");
    contains(info.warnings[1], "28 uneven slices are resampled to 37");
}

TEST(ReadReal, UnevenAndMixedSetsAreRefused) {
    MARROW_TEST_SCAN(sets, "n_dicom2nifti_failing/nasty_dicom/dicom2nifti/data/failing");
    contains(refusal<GeometryError>(sets / "sliceincrement/001"), "uneven: 10 mm between");
    contains(refusal<GeometryError>(sets / "sliceincrement/002"), "uneven: 1.499 mm between");
    contains(refusal<GeometryError>(sets / "sliceorientation/001"), "2 series");
    contains(refusal<GeometryError>(sets / "notavolume/001"), "same position");
}

TEST(ReadReal, TiltedScanIsSheared) {
    MARROW_TEST_SCAN(scan, "n_dicom2nifti_failing/nasty_dicom/dicom2nifti/data/failing/gantrytilting/001");
    ScanInfo info;
    const Geometry g = read_scan(scan, {}, &info).geometry();
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "tilted by 14.0 degrees");
    const double along = g.direction[1][1] * g.direction[1][2] + g.direction[2][1] * g.direction[2][2];
    EXPECT_NEAR(std::abs(along), std::sin(14 * M_PI / 180), 1e-3);
}

TEST(ReadReal, EveryTransferSyntaxDecodesToTheSamePixels) {
    MARROW_TEST_SCAN(images, "n_cornerstone3d_ctimage/nasty_dicom/cornerstone3d/testImages");
    const auto pixels = [](const fs::path& file) {
        TemporaryFolder folder;  // alone, because together they are slices with the same position
        fs::copy(file, folder / "one.dcm");
        const Vec3d in_plane = inspect_scan(folder.path()).series.at(0).series.spacing;
        ScanOptions options;
        options.spacing = Vec3d{in_plane[0], in_plane[1], 1};
        const Volume v = read_scan(folder.path(), options);
        std::vector<double> out;
        for (std::int64_t i = 0; i < v.geometry().sample_count(); ++i) {
            out.push_back(v.type() == SampleType::int16 ? v.samples<std::int16_t>()[i]
                                                        : v.samples<float>()[i]);
        }
        return out;
    };
    const auto truth = pixels(images / "CTImage.dcm");
    int lossless = 0, lossy = 0;
    testing::internal::CaptureStderr();
    for (const auto& entry : fs::directory_iterator(images)) {
        SCOPED_TRACE(entry.path().filename());
        const std::string name = entry.path().filename();
        const auto read = pixels(entry.path());
        ASSERT_EQ(read.size(), truth.size());
        const bool loses =
            name.find("JPEGProcess1T") != name.npos || name.find("JPEGProcess2_4") != name.npos ||
            name.find("JPEGProcess6_8") != name.npos || name.find("JPEGProcess10_12") != name.npos ||
            name.find("4.91") != name.npos || name.find("4.81") != name.npos;
        if (!loses) {
            EXPECT_EQ(read, truth);
            ++lossless;
        } else {
            double sum = 0;
            for (std::size_t i = 0; i < read.size(); ++i) sum += std::abs(read[i] - truth[i]);
            EXPECT_LT(sum / static_cast<double>(read.size()), 25);  // HU; 8-bit JPEG has steps of 17
            ++lossy;
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(lossless, 10);
    EXPECT_EQ(lossy, 6);
}

TEST(ReadReal, TwoEchoesAreTwoVolumes) {
    MARROW_TEST_SCAN(scan, "knee_t2_2echo_bigendian");
    const auto series = inspect_scan(scan).series;
    ASSERT_EQ(series.size(), 1u);
    EXPECT_EQ(series[0].volumes, (std::vector<std::string>{"echo time 6.312 ms", "echo time 12.624 ms"}));
    ScanOptions options;
    options.volume = 0;
    const Volume first = read_scan(scan, options);
    options.volume = 1;
    const Volume second = read_scan(scan, options);
    EXPECT_EQ(first.geometry().dims[2], 24);
    EXPECT_NEAR(first.geometry().spacing[2], 4, 1e-3);
    EXPECT_LT(farthest_corner(first.geometry(), second.geometry()), 1e-6);
    EXPECT_NE(samples_of<std::int16_t>(first), samples_of<std::int16_t>(second));
}

double sample_at(const Volume& v, const std::array<std::int64_t, 3>& index) {
    const auto& dims = v.geometry().dims;
    const std::int64_t i = (index[2] * dims[1] + index[1]) * dims[0] + index[0];
    switch (v.type()) {
        case SampleType::uint8:
            return v.samples<std::uint8_t>()[i];
        case SampleType::int16:
            return v.samples<std::int16_t>()[i];
        case SampleType::uint16:
            return v.samples<std::uint16_t>()[i];
        default:
            return v.samples<float>()[i];
    }
}

// The fractional index of a position.
Vec3d index_at(const Geometry& g, const Vec3d& position) {
    const Mat3d m = g.index_to_physical();
    const auto column = [&](int a) { return Vec3d{m[0][a], m[1][a], m[2][a]}; };
    const Vec3d x = column(0), y = column(1), z = column(2), p = position - g.origin;
    const double volume = dot(x, cross(y, z));
    return {dot(p, cross(y, z)) / volume, dot(p, cross(z, x)) / volume, dot(p, cross(x, y)) / volume};
}

// Each volume of a DICOM series has the samples of the same volume in NIfTI, at the same places.
void expect_volumes_of_nifti(const fs::path& dicom, const fs::path& nifti, std::int64_t volumes) {
    const auto series = inspect_scan(dicom).series;
    ASSERT_EQ(series.size(), 1u);
    ASSERT_EQ(series[0].volumes.size(), static_cast<std::size_t>(volumes));
    for (std::int64_t v = 0; v < volumes; ++v) {
        SCOPED_TRACE(v);
        ScanOptions options;
        options.volume = v;
        const Volume a = read_scan(dicom, options), b = read_scan(nifti, options);
        ASSERT_EQ(a.geometry().sample_count(), b.geometry().sample_count());
        std::int64_t different = 0;
        const auto& dims = a.geometry().dims;
        for (std::int64_t k = 0; k < dims[2]; ++k) {
            for (std::int64_t j = 0; j < dims[1]; ++j) {
                for (std::int64_t i = 0; i < dims[0]; ++i) {
                    const Vec3d index{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
                    const Vec3d at = index_at(b.geometry(), a.geometry().physical(index));
                    std::array<std::int64_t, 3> near;
                    for (int axis = 0; axis < 3; ++axis) {
                        near[axis] = std::lround(at[axis]);
                        ASSERT_NEAR(at[axis], static_cast<double>(near[axis]), 0.01);
                    }
                    const double x = sample_at(a, {i, j, k}), y = sample_at(b, near);
                    different += std::abs(x - y) > 1e-4 * std::max(1.0, std::abs(x));
                }
            }
        }
        EXPECT_EQ(different, 0);
    }
}

TEST(ReadReal, TimePointsAreThoseOfTheNifti) {
    MARROW_TEST_SCAN(scans, "n_dicom_4d");
    for (const auto& [name, volumes] :
         {std::pair("ge_fmri", 2), std::pair("siemens_fmri", 2), std::pair("philips_enhanced_fmri", 4)}) {
        SCOPED_TRACE(name);
        expect_volumes_of_nifti(scans / name / "001", scans / name / "001_ground_truth.nii.gz", volumes);
    }
    SCOPED_TRACE("siemens_mosaic");
    const fs::path mosaics = scans / "siemens_mosaic";
    expect_volumes_of_nifti(mosaics / "ep2d_Asc_2", mosaics / "2_ep2d_Asc.nii", 6);
}

TEST(ReadReal, RtDoseIsTheSameInBothByteOrders) {
    MARROW_TEST_SCAN(files, "n_pydicom/nasty_dicom/pydicom/test_files");
    std::vector<float> first;
    for (const char* name : {"rtdose.dcm", "rtdose_expb.dcm", "rtdose_rle.dcm"}) {
        SCOPED_TRACE(name);
        TemporaryFolder folder;
        fs::copy(files / name, folder / name);
        const Volume v = read_scan(folder.path());
        EXPECT_EQ(v.geometry().dims, (std::array<std::int64_t, 3>{10, 10, 15}));
        EXPECT_NEAR(v.geometry().spacing[2], 5, 1e-9);
        const auto samples = samples_of<float>(v);
        EXPECT_FLOAT_EQ(*std::max_element(samples.begin(), samples.end()), 1.254f);  // Gy
        if (first.empty()) first = samples;
        EXPECT_EQ(samples, first);
    }
}

TEST(ReadReal, EnhancedMultiFrame) {
    MARROW_TEST_SCAN(scan, "n_xa30_enh");
    ScanInfo info;
    const Geometry g = read_scan(scan, {}, &info).geometry();
    EXPECT_EQ(g.dims, (std::array<std::int64_t, 3>{128, 128, 96}));
    EXPECT_NEAR(g.spacing[2], 2, 1e-4);
    EXPECT_EQ(info.series.files, 1u);
}

TEST(ReadReal, DicomAndItsLabelsInNiftiHaveTheSameExtent) {
    MARROW_TEST_SCAN(dicom, "totalseg/totalseg/example_ct_dicom");
    MARROW_TEST_SCAN(nifti, "totalseg/totalseg/example_seg_dicom.nii.gz");
    const Geometry a = read_scan(dicom).geometry(), b = read_scan(nifti).geometry();
    // The rows have the opposite direction in NIfTI.
    expect_at(b, {0, static_cast<double>(b.dims[1] - 1), 0}, a.origin, 1e-3);
    expect_at(b, {10, static_cast<double>(b.dims[1] - 1) - 20, 5}, a.physical({10, 20, 5}), 1e-3);
}

TEST(ReadReal, OneScanIsTheSameInNrrdAndMetaImage) {
    MARROW_TEST_SCAN(folder, "n_nifti/nasty_nifti/i2nii/test");
    const Volume a = read_scan(folder / "nrrd.nhdr"), b = read_scan(folder / "mha.mha");
    EXPECT_EQ(samples_of<std::int16_t>(a), samples_of<std::int16_t>(b));
    EXPECT_LT(farthest_corner(a.geometry(), b.geometry()), 1e-3);
}

TEST(ReadReal, BothByteOrdersAndVersionsOfNifti) {
    MARROW_TEST_SCAN(folder, "n_nifti/nasty_nifti/nrjs");
    EXPECT_EQ(samples_of<float>(read_scan(folder / "big.nii.gz")),
              samples_of<float>(read_scan(folder / "little.nii.gz")));
    const Volume one = read_scan(folder / "avg152T1_LR_nifti.nii.gz"),
                 two = read_scan(folder / "avg152T1_LR_nifti2.nii.gz");
    EXPECT_LT(farthest_corner(one.geometry(), two.geometry()), 1e-6);
}

// Each unusual file is read, or refused with a message of one line. Nothing is printed.
TEST(ReadReal, UnusualFilesAreReadOrRefused) {
    const char* root = std::getenv("MARROW_TEST_DATA");
    if (!root) GTEST_SKIP() << "no MARROW_TEST_DATA";
    int read = 0, refused = 0;
    testing::internal::CaptureStderr();
    for (const char* name :
         {"n_pydicom", "n_nifti", "n_dicom2nifti_failing", "n_dupepos", "n_xa30_enh", "dem_sthelens"}) {
        if (!fs::exists(fs::path(root) / name)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(fs::path(root) / name)) {
            if (!entry.is_regular_file()) continue;
            SCOPED_TRACE(entry.path());
            TemporaryFolder folder;
            fs::copy(entry.path(), folder / entry.path().filename());
            try {
                ScanOptions options;
                read_scan(folder / entry.path().filename(), options);
                ++read;
            } catch (const Error& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
                ++refused;
            }
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    if (read + refused == 0) GTEST_SKIP() << "no odd files in MARROW_TEST_DATA";
    EXPECT_GT(read, 0);
    EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace marrow::test
