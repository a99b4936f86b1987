// What each case of DICOM becomes, row by row: the table is in docs/reliability.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "compressed_pixels.h"
#include "dicom_series.h"
#include "reading_checks.h"

namespace marrow::test {
namespace {

TEST(DicomTable, SliceOrderComesFromPositionsNotFromNames) {
    TemporaryFolder folder;
    const std::array names = {"c.dcm", "a.dcm", "d", "nested/b.IMA"};
    for (int k = 0; k < 4; ++k) {
        DicomWriter s = slice(k, 5 + 2.5 * k);
        s.text(0x00200013, "IS", std::to_string(10 - k));     // InstanceNumber the other way round
        s.text(0x00201041, "DS", std::to_string(k * 7 % 4));  // SliceLocation at random
        s.write(folder / names[static_cast<std::size_t>(k)]);
    }
    ScanInfo info;
    const Volume v = read_scan(folder.path(), {}, &info);
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(4));
    expect_at(v.geometry(), {0, 0, 0}, {10, 20, 5});
    expect_at(v.geometry(), {2, 1, 3}, {12, 21, 12.5});
    EXPECT_EQ(info.format, "DICOM");
    EXPECT_EQ(info.series.modality, "CT");
    EXPECT_EQ(info.series.files, 4u);
    EXPECT_TRUE(info.warnings.empty()) << info.warnings[0];
}

TEST(DicomTable, PixelSpacingIsRowThenColumn) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int) { s.spacing("0.5\\0.25"); });
    const Volume v = read_scan(folder.path());
    expect_at(v.geometry(), {1, 0, 0}, {10.25, 20, 0});
    expect_at(v.geometry(), {0, 1, 0}, {10, 20.5, 0});
}

TEST(DicomTable, GantryTiltBecomesAShearedVolume) {
    TemporaryFolder folder;
    write_series(folder, 4, "s", [](DicomWriter& s, int k) {
        s.position("0\\" + std::to_string(-0.5 * k) + "\\" + std::to_string(2.0 * k));
    });
    ScanInfo info;
    const Volume v = read_scan(folder.path(), {}, &info);
    expect_at(v.geometry(), {1, 1, 3}, {1, 1 - 1.5, 6});
    EXPECT_NEAR(v.geometry().spacing[2], std::hypot(0.5, 2), 1e-9);
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "tilted by 14.0 degrees");
}

TEST(DicomTable, RescaleIsAppliedToEachSlice) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int k) { s.rescale(std::to_string(k + 1), "-1024"); });
    const auto read = samples_of<std::int16_t>(read_scan(folder.path()));
    ASSERT_EQ(read.size(), 18u);
    EXPECT_EQ(read[0], -1024);
    EXPECT_EQ(read[6], 2 * 100 - 1024);
    EXPECT_EQ(read[17], 3 * 212 - 1024);
}

TEST(DicomTable, UnusableRescaleIsRefused) {
    for (const char* slope : {"0", "nan", "x"}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) { s.rescale(slope, "0"); });
        contains(refusal<InputError>(folder.path()), "rescale");
    }
}

TEST(DicomTable, CtWithoutRescaleWarns) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) {
        s.elements.erase(0x00281052);
        s.elements.erase(0x00281053);
    });
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(2));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "not HU");
}

TEST(DicomTable, UnusedBitsAreMaskedAndTheSignExtended) {
    TemporaryFolder folder;
    // 12 bits, signed, in the middle of the cell: bits 2 to 13; the others are junk
    write_series(folder, 2, "s", [](DicomWriter& s, int) {
        s.pixel_format(16, 12, true);
        s.number(0x00280102, 13);
        const auto cell = [](int value) {
            return static_cast<std::uint16_t>(0xc003 | ((value & 0xfff) << 2));
        };
        s.pixels<std::uint16_t>(columns, rows,
                                {cell(-2048), cell(-1), cell(0), cell(1), cell(2047), cell(-1000)});
    });
    const auto read = samples_of<std::int16_t>(read_scan(folder.path()));
    EXPECT_EQ(std::vector<std::int16_t>(read.begin(), read.begin() + 6),
              (std::vector<std::int16_t>{-2048, -1, 0, 1, 2047, -1000}));
}

TEST(DicomTable, Monochrome1KeepsItsValues) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) { s.text(0x00280004, "CS", "MONOCHROME1"); });
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path())), volume_samples(2));
}

TEST(DicomTable, ColourIsRefused) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) {
        s.text(0x00280004, "CS", "RGB");
        s.number(0x00280002, 3);
    });
    contains(refusal<InputError>(folder.path()), "colour");
}

TEST(DicomTable, EveryPlainTransferSyntaxAndRunLengthsGiveTheSameSamples) {
    for (const Form form : {Form::explicit_little, Form::implicit_little, Form::explicit_big, Form::deflated,
                            Form::run_length, Form::no_preamble}) {
        SCOPED_TRACE(static_cast<int>(form));
        TemporaryFolder folder;
        write_series(folder, 3, "s", [&](DicomWriter& s, int) { s.form = form; });
        const Volume v = read_scan(folder.path());
        EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(3));
        expect_at(v.geometry(), {1, 1, 1}, {11, 21, 2});
    }
}

TEST(DicomTable, UnevenSlicesAreRefusedByName) {
    TemporaryFolder folder;
    write_series(folder, 6);
    fs::remove(folder / "slice3");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "slice2");
    contains(what, "slice4");
    contains(what, "4 mm");
}

TEST(DicomTable, UnevennessCountsFromAHundredthOfAMillimetre) {
    for (const auto& [shift, good] : {std::pair(0.004, true), std::pair(0.02, false)}) {
        TemporaryFolder folder;
        write_series(folder, 5, "s", [&, s = shift](DicomWriter& w, int k) {
            w.position("0\\0\\" + std::to_string(2.0 * k + (k == 2 ? s : 0)));
        });
        if (good)
            EXPECT_NEAR(read_scan(folder.path()).geometry().spacing[2], 2, 1e-9);
        else
            contains(refusal<GeometryError>(folder.path()), "uneven");
    }
}

TEST(DicomTable, SeveralSeriesAreListedAndOneCanBeChosen) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 4, "b", [](DicomWriter& s, int) {
        s.text(0x0020000e, "UI", "1.2.4");
        s.text(0x0008103e, "LO", "lung");
    });
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "1.2.3");
    contains(what, "1.2.4 (CT, 'lung', 3 x 2 x 4, 4 files)");

    ScanOptions options;
    options.series = "1.2.4";
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options, &info)), volume_samples(4));
    EXPECT_EQ(info.series.description, "lung");
    options.series = "1.2.5";
    contains(refusal<GeometryError>(folder.path(), options), "no series '1.2.5'");

    std::string format;
    const auto series = list_series(folder.path(), &format);
    EXPECT_EQ(format, "DICOM");
    ASSERT_EQ(series.size(), 2u);
    EXPECT_EQ(series[0].id, "1.2.4");
    EXPECT_EQ(series[0].dims[2], 4);
    EXPECT_EQ(series[1].spacing[2], 2);
}

TEST(DicomTable, OneSeriesIsSplitWhereItsGeometryDiffers) {
    const std::vector<std::pair<const char*, std::function<void(DicomWriter&, int)>>> changes = {
        {"orientation", [](DicomWriter& s, int) { s.orientation("0\\1\\0\\1\\0\\0"); }},
        {"frame of reference", [](DicomWriter& s, int) { s.text(0x00200052, "UI", "1.2.8"); }},
        {"spacing", [](DicomWriter& s, int) { s.spacing("2\\2"); }},
        {"echo", [](DicomWriter& s, int) { s.text(0x00180086, "IS", "2"); }},
        {"size",
         [](DicomWriter& s, int) {
             s.pixels<std::int16_t>(2, 2, {1, 2, 3, 4});
         }},
        {"far apart", [](DicomWriter& s, int k) { s.position("10\\20\\" + std::to_string(1000 + 2 * k)); }}};
    for (const auto& [name, change] : changes) {
        SCOPED_TRACE(name);
        TemporaryFolder folder;
        write_series(folder, 4, "a");
        write_series(folder, 3, "b", change);
        contains(refusal<GeometryError>(folder.path()), "1.2.3/2");
        ScanOptions options;
        options.series = "1.2.3/1";
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(4));
    }
}

TEST(DicomTable, ScoutsAreLeftOut) {
    TemporaryFolder folder;
    write_series(folder, 3);
    DicomWriter scout = slice(7, 0);
    scout.text(0x0020000e, "UI", "1.2.7");
    scout.text(0x00080008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER");
    scout.write(folder / "scout");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(3));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "scout");
}

TEST(DicomTable, FilesWithoutAnImageAreLeftOut) {
    TemporaryFolder folder;
    DicomWriter report;
    report.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.88.11");
    report.write(folder / "report");
    contains(refusal<InputError>(folder.path()), "none of 1 DICOM files holds an image");
    write_series(folder, 2);
    write_file(folder / "notes.txt", "nothing");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(2));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "1 DICOM files hold no image");
}

TEST(DicomTable, EnhancedMultiFrame) {
    TemporaryFolder folder;
    enhanced(5).write(folder / "frames.dcm");
    const Volume v = read_scan(folder / "frames.dcm");
    auto expected = volume_samples(5);
    for (std::size_t i = 0; i < expected.size(); ++i)
        expected[i] = static_cast<std::int16_t>(expected[i] + 1000 * (i / 6));
    EXPECT_EQ(samples_of<std::int16_t>(v), expected);
    expect_at(v.geometry(), {1, 1, 2}, {14, 23, 4});
}

TEST(DicomTable, ResampleMakesUnevenSlicesEven) {
    TemporaryFolder folder;
    write_series(folder, 6);  // 2 mm apart
    fs::remove(folder / "slice3");
    contains(refusal<GeometryError>(folder.path()), "--resample");
    ScanOptions options;
    options.resample = true;
    ScanInfo info;
    const Volume v = read_scan(folder.path(), options, &info);
    // the samples are linear in the place, and so is what comes between
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(6));
    expect_at(v.geometry(), {0, 0, 5}, {10, 20, 10});
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "5 uneven slices are resampled to 6");
    EXPECT_EQ(info.series.dims[2], 6);
}

TEST(DicomTable, ResampleKeepsTheEndsAndTheTilt) {
    TemporaryFolder folder;
    const std::array places = {0.0, 1.0, 2.0, 3.5, 4.5};
    for (int k = 0; k < 5; ++k) {
        const double z = places[static_cast<std::size_t>(k)];
        DicomWriter s = slice(k, 0);
        s.pixels<std::int16_t>(columns, rows,
                               std::vector<std::int16_t>(6, static_cast<std::int16_t>(std::lround(20 * z))));
        s.position("0\\" + std::to_string(0.25 * z) + "\\" + std::to_string(z));
        s.write(folder / ("s" + std::to_string(k)));
    }
    ScanOptions options;
    options.resample = true;
    const Volume v = read_scan(folder.path(), options);
    const auto n = static_cast<double>(v.geometry().dims[2] - 1);
    EXPECT_EQ(n, 5);  // 4.5 mm in steps of about 1 mm: 0.9
    expect_at(v.geometry(), {0, 0, 0}, {0, 0, 0});
    expect_at(v.geometry(), {0, 0, n}, {0, 1.125, 4.5});
    for (int k = 0; k <= 5; ++k) EXPECT_EQ(v.samples<std::int16_t>()[6 * k], 18 * k) << k;
}

TEST(DicomTable, TheTiltTagAloneMeansNothing) {
    TemporaryFolder folder;
    write_series(folder, 4, "s", [](DicomWriter& s, int) { s.text(0x00181120, "DS", "18.5"); });
    ScanInfo info;
    expect_at(read_scan(folder.path(), {}, &info).geometry(), {0, 0, 3}, {10, 20, 6});
    EXPECT_TRUE(info.warnings.empty());
}

TEST(DicomTable, DuplicatesWithTheSamePixelsCountOnce) {
    TemporaryFolder folder;
    write_series(folder, 4);
    slice(1, 2.0).write(folder / "again");
    slice(3, 6.0).write(folder / "nested/again");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(4));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "2 slices are there twice");
}

TEST(DicomTable, DuplicatesWithOtherPixelsAreRefusedByGroups) {
    TemporaryFolder folder;
    write_series(folder, 4);
    slice(9, 2.0).write(folder / "again");
    slice(8, 6.0).write(folder / "more");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "again' and");
    contains(what, "slice1'");
    contains(what, "more' and");
    contains(what, "slice3'");
}

TEST(DicomTable, DuplicatesThatDifferInRescaleAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 3);
    DicomWriter other = slice(1, 2.0);
    other.rescale("1", "-1024");
    other.write(folder / "again");
    contains(refusal<GeometryError>(folder.path()), "same place");
}

TEST(DicomTable, ASingleSliceNeedsASpacing) {
    TemporaryFolder folder;
    slice(0, 7).write(folder / "one");
    contains(refusal<GeometryError>(folder.path()), "single slice; --spacing");
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 2.5};
    const Volume v = read_scan(folder.path(), options);
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(1));
    expect_at(v.geometry(), {1, 1, 1}, {11, 21, 9.5});
}

TEST(DicomTable, SlicesWithoutAPlaceNeedASpacing) {
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u}) {
        TemporaryFolder folder;
        const std::array names = {"c", "a", "b"};
        for (int k = 0; k < 3; ++k) {
            DicomWriter s = slice(k, 2.0 * k);
            s.text(0x00200013, "IS", std::to_string(k + 9));
            s.elements.erase(tag);
            s.write(folder / names[static_cast<std::size_t>(k)]);
        }
        const std::string what = refusal<GeometryError>(folder.path());
        contains(what, tag == 0x00280030u ? "PixelSpacing" : "position");
        contains(what, "--spacing");
        ScanOptions options;
        options.spacing = Vec3d{0.5, 0.5, 2};
        if (tag != 0x00280030u) options.spacing = Vec3d{1, 1, 2};
        ScanInfo info;
        const Volume v = read_scan(folder.path(), options, &info);
        EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(3));  // by InstanceNumber
        EXPECT_EQ(v.geometry().spacing, *options.spacing);
        EXPECT_EQ(info.warnings.size(), tag == 0x00280030u ? 0u : 1u);
    }
}

TEST(DicomTable, ASpacingMayNotContradictTheHeaders) {
    TemporaryFolder folder;
    write_series(folder, 3);
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 3};
    contains(refusal<GeometryError>(folder.path(), options), "1 x 1 x 2 mm; do not give another");
}

TEST(DicomTable, FramesWithoutAPlaceNeedASpacing) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.elements.erase(0x52009230);
    frames.write(folder / "frames.dcm");
    contains(refusal<GeometryError>(folder.path()), "no position");
    ScanOptions options;
    options.spacing = Vec3d{4, 3, 2};
    EXPECT_EQ(read_scan(folder.path(), options).geometry().dims[2], 5);
}

TEST(DicomTable, MoreFramesThanBytesAreRefused) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.text(0x00280008, "IS", "6");
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "describes 5 frames and has 6");
    frames = enhanced(5);
    frames.elements[0x7fe00010].second.resize(2 * (5 * columns * rows - 1));
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "truncated");
}

TEST(DicomTable, FramesWithoutEndAreRefusedBeforeTheyCost) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.elements.erase(0x52009230);
    frames.text(0x00280008, "IS", "99999");
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "claims 99999 frames");
    frames.text(0x00280008, "IS", "99");
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "too small");
}

// Each frame is compared with the volumes there are, which a hostile file makes as many as it has frames.
TEST(DicomTable, ASeriesOfThousandsOfVolumesIsRefused) {
    TemporaryFolder folder;
    constexpr int count = 3000;
    DicomWriter frames;
    frames.text(0x00280008, "IS", std::to_string(count));
    frames.pixels(1, 1, std::vector<std::int16_t>(count));
    std::string groups;
    for (int i = 0; i < count; ++i) {
        std::string spacing = std::to_string(1 + i) + "\\1";
        if (spacing.size() % 2 != 0) spacing += ' ';
        const auto form = DicomWriter::Form::explicit_little;
        const std::string measures = DicomWriter::element(0x00280030, "DS", spacing, form);
        groups +=
            DicomWriter::item(DicomWriter::element(0x00289110, "SQ", DicomWriter::item(measures), form));
    }
    frames.elements[0x52009230] = {"SQ", groups};
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "more than 2000 volumes");
}

TEST(DicomTable, OddFrameOfMultiFrameIsRefusedOrSplit) {
    // the frames of one file are held to the same rules as files
    TemporaryFolder folder;
    enhanced(6).write(folder / "frames.dcm");
    std::string bytes = read_file(folder / "frames.dcm");
    const std::size_t at = bytes.find("10\\20\\6 ");
    ASSERT_NE(at, bytes.npos);
    bytes.replace(at, 8, "10\\20\\7 ");
    write_file(folder / "frames.dcm", bytes);
    contains(refusal<GeometryError>(folder.path()), "frames.dcm' frame");
}

std::vector<std::uint16_t> codec_samples(int width, int height, int bits) {
    std::vector<std::uint16_t> out;
    for (int i = 0; i < width * height; ++i)
        out.push_back(static_cast<std::uint16_t>((i * 2654435761u >> 7) & ((1u << bits) - 1)));
    return out;
}

TEST(DicomTable, LosslessTransferSyntaxesGiveTheSamePixels) {
    constexpr int width = 13, height = 9;
    for (const int bits : {8, 12, 16}) {
        const auto samples = codec_samples(width, height, bits);
        std::vector<std::pair<std::string, std::string>> streams = {
            {"1.2.840.10008.1.2.4.80", jpeg_ls(width, height, samples, bits == 8 ? 9 : bits)},
            {"1.2.840.10008.1.2.4.90", jpeg_2000(width, height, samples, bits)}};
        for (int predictor = 1; predictor <= 7; ++predictor)
            streams.emplace_back("1.2.840.10008.1.2.4.57",
                                 lossless_jpeg(width, height, samples, bits, predictor, predictor % 2 == 0));
        for (const auto& [syntax, stream] : streams) {
            SCOPED_TRACE(syntax + " of " + std::to_string(bits) + " bits");
            TemporaryFolder folder;
            DicomWriter s;
            s.pixel_format(bits == 8 ? 8 : 16, bits, false);
            s.pixels<std::uint16_t>(width, height, samples);
            s.compressed_syntax = syntax;
            const std::string whole = even(stream);
            const std::size_t half = whole.size() / 4 * 2;
            s.fragments = {whole.substr(0, half), whole.substr(half)};  // one frame may lie in several
            const fs::path path = s.write(folder / "one.dcm");
            ScanOptions options;
            options.spacing = Vec3d{1, 1, 1};
            const Volume v = read_scan(path, options);
            for (std::size_t i = 0; i < samples.size(); ++i) {
                const double value =
                    v.type() == SampleType::int16 ? v.samples<std::int16_t>()[i] : v.samples<float>()[i];
                ASSERT_EQ(value, samples[i]) << i;
            }
        }
    }
}

TEST(DicomTable, LossyTransferSyntaxesGiveNearlyTheSamePixels) {
    constexpr int width = 20, height = 12;  // 3 x 2 blocks, cut at two sides
    for (const int bits : {8, 12}) {
        for (const bool progressive : {false, true}) {
            const int most = (1 << bits) - 2;  // the encoder adds an eighth
            const std::vector<int> values = {1, most, most / 2, 7, most / 3, 77};
            TemporaryFolder folder;
            DicomWriter s;
            s.pixel_format(bits == 8 ? 8 : 16, bits, false);
            s.pixels(width, height, std::vector<std::uint16_t>(width * height));
            s.compressed_syntax = progressive ? "1.2.840.10008.1.2.4.55"
                                  : bits == 8 ? "1.2.840.10008.1.2.4.50"
                                              : "1.2.840.10008.1.2.4.51";
            s.fragments = {even(flat_jpeg(width, height, values, bits, progressive))};
            ScanOptions options;
            options.spacing = Vec3d{1, 1, 1};
            const auto read = samples_of<std::int16_t>(read_scan(s.write(folder / "one.dcm"), options));
            for (int y = 0; y < height; ++y) {
                for (int x = 0; x < width; ++x)
                    ASSERT_EQ(read[static_cast<std::size_t>(y * width + x)],
                              values[static_cast<std::size_t>(y / 8 * 3 + x / 8)])
                        << x << ' ' << y;
            }
        }
    }
}

// Each scan is work for the whole picture, so a small file of many could keep a reader busy for hours.
TEST(DicomTable, JpegOfManyScansIsRefused) {
    TemporaryFolder folder;
    constexpr int width = 16, height = 8;
    const std::string whole = flat_jpeg(width, height, {1, 200}, 8, true);
    const std::string no_news = jpeg_scan(1, 63, 0, "\x3f");  // two blocks without coefficients
    DicomWriter s;
    s.pixel_format(8, 8, false);
    s.pixels(width, height, std::vector<std::uint8_t>(width * height));
    s.compressed_syntax = "1.2.840.10008.1.2.4.55";
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const int scans : {10, 1000}) {
        std::string stream = whole;
        for (int i = 0; i < scans; ++i) stream.insert(whole.size() - 2, no_news);
        s.fragments = {even(stream)};
        s.write(folder / "one.dcm");
        if (scans == 10)
            EXPECT_NO_THROW(read_scan(folder / "one.dcm", options));
        else
            contains(refusal<InputError>(folder / "one.dcm", options), "JPEG");
    }
}

TEST(DicomTable, CompressedFramesAreFoundByTheirTable) {
    TemporaryFolder folder;
    DicomWriter s = enhanced(3);
    const std::string pixels = s.elements[0x7fe00010].second;
    s.compressed_syntax = "1.2.840.10008.1.2.4.57";
    std::uint32_t at = 0;
    for (std::size_t n = 0; n < 3; ++n) {
        std::vector<std::uint16_t> samples(columns * rows);
        std::memcpy(samples.data(), pixels.data() + n * 2 * samples.size(), 2 * samples.size());
        const std::string stream = even(lossless_jpeg(columns, rows, samples, 16, 1, false));
        s.offset_table += bytes_of(at);
        for (std::size_t from = 0, part = 20 + 10 * n; from < stream.size(); from += part) {
            s.fragments.push_back(stream.substr(from, part));
            at += static_cast<std::uint32_t>(8 + s.fragments.back().size());
        }
    }
    const auto expected = [] {
        auto all = volume_samples(3);
        for (std::size_t i = 0; i < all.size(); ++i)
            all[i] = static_cast<std::int16_t>(all[i] + 1000 * (i / 6));
        return all;
    }();
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(s.write(folder / "frames.dcm"))), expected);
    s.offset_table.clear();
    s.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "no table");
}

TEST(DicomTable, UnknownTransferSyntaxAndVideoAreRefusedByName) {
    for (const auto& [uid, name] : {std::pair("1.2.840.10008.1.2.9", "1.2.840.10008.1.2.9"),
                                    std::pair("1.2.840.10008.1.2.4.102", "MPEG-4 video"),
                                    std::pair("1.2.840.10008.1.2.4.201", "high-throughput JPEG 2000")}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&, uid = uid](DicomWriter& s, int) {
            s.compressed_syntax = uid;
            if (s.compressed_syntax.size() % 2) s.compressed_syntax += '\0';
            s.fragments = {"some bytes"};
        });
        contains(refusal<InputError>(folder.path()), name);
    }
}

TEST(DicomTable, DicomdirStandsForItsFolder) {
    TemporaryFolder folder;
    DicomWriter directory;
    directory.elements.erase(0x00080016);
    directory.elements[0x00041220] = {"SQ", ""};
    directory.write(folder / "DICOMDIR");
    write_series(folder, 3, "IMAGES/IM");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder / "DICOMDIR", {}, &info)), volume_samples(3));
    contains(info.warnings.at(0), "1 DICOM files hold no image");
}

TEST(DicomTable, WithoutAPreambleADataSetThatParsesIsRead) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int) { s.form = Form::no_preamble; });
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path())), volume_samples(3));
    const std::string bytes = read_file(folder / "s1");
    write_file(folder / "s1", bytes.substr(0, 60));
    TemporaryFolder alone;
    write_file(alone / "half", bytes.substr(0, 60));
    contains(refusal<InputError>(alone / "half"), "damaged");
}

// The same scan by way of four formats: the surface has the same points.
TEST(DicomTable, OneScanInAllFormatsGivesTheSamePoints) {
    constexpr int n = 12;
    const auto value = [](int x, int y, int z) {
        const double d = std::hypot(x - 5.5, y - 5.0, 1.5 * (z - 5.2));
        return static_cast<std::int16_t>(std::lround(1000 - 300 * d));
    };
    TemporaryFolder folder;
    std::string raw;
    for (int z = 0; z < n; ++z) {
        std::vector<std::int16_t> samples;
        for (int i = 0; i < n * n; ++i) samples.push_back(value(i % n, i / n, z));
        raw += bytes_of(samples);
        DicomWriter s;
        s.pixels(n, n, samples);
        s.orientation("0.8\\0.6\\0\\0\\0\\-1");  // normal (-0.6, 0.8, 0), slices sheared along y
        s.position(std::to_string(5 - 0.9 * z) + "\\" + std::to_string(-7 + 1.2 * z) + "\\" +
                   std::to_string(3 + 0.25 * z));
        s.spacing("0.75\\0.5");
        s.write(folder / "dicom" / std::to_string(z));
    }
    NiftiWriter nifti;
    nifti.dim = {3, n, n, n};
    nifti.sform_code = 1;
    nifti.srow = {{{-0.4f, 0, 0.9f, -5}, {-0.3f, 0, -1.2f, 7}, {0, -0.75f, 0.25f, 3}}};
    write_file(folder / "a.nii.gz", gzipped(nifti.header() + raw));
    write_file(folder / "b.nrrd",
               "NRRD0004\ntype: short\ndimension: 3\nsizes: 12 12 12\nendian: little\nencoding: raw\nspace: "
               "LPS\nspace directions: (0.4,0.3,0) (0,0,-0.75) (-0.9,1.2,0.25)\nspace origin: (5,-7,3)\n\n" +
                   raw);
    write_file(
        folder / "c.mha",
        "ObjectType = Image\nNDims = 3\nDimSize = 12 12 12\nElementType = MET_SHORT\nElementSpacing = 1 1 "
        "1\nTransformMatrix = 0.4 0.3 0 0 0 -0.75 -0.9 1.2 0.25\nOffset = 5 -7 3\nElementDataFile = "
        "LOCAL\n" +
            raw);
    const Volume first = read_scan(folder / "dicom");
    const Mesh mesh = extract_isosurface(first, 0);
    ASSERT_GT(mesh.points.size(), 100u);
    for (const char* name : {"a.nii.gz", "b.nrrd", "c.mha"}) {
        SCOPED_TRACE(name);
        const Volume volume = read_scan(folder / name);
        const Mesh other = extract_isosurface(volume, 0);
        ASSERT_EQ(other.points.size(), mesh.points.size());
        EXPECT_EQ(other.triangles, mesh.triangles);
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            for (int a = 0; a < 3; ++a) ASSERT_NEAR(other.points[i][a], mesh.points[i][a], 1e-3) << i;
        }
    }
}

}  // namespace
}  // namespace marrow::test
