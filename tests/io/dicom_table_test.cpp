// The rows about slices and series of the DICOM table in docs/reliability.md. dicom_pixels_test.cpp has those
// about pixels.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include <marrow/error.h>
#include <marrow/isosurface.h>

#include "support/dicom_series.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

TEST(DicomTable, SliceOrderComesFromPositionsNotFromNames) {
    TemporaryFolder folder;
    const std::array names = {"c.dcm", "a.dcm", "d", "nested/b.IMA"};
    for (int k = 0; k < 4; ++k) {
        DicomWriter s = slice(k, 5 + 2.5 * k);
        s.text(0x00200013, "IS", std::to_string(10 - k));     // InstanceNumber in reverse order
        s.text(0x00201041, "DS", std::to_string(k * 7 % 4));  // a random SliceLocation
        s.write(folder / names[static_cast<std::size_t>(k)]);
    }
    ScanInfo info;
    const Volume v = read_scan(folder.path(), {}, &info);
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(4));
    expect_at(v.geometry(), {0, 0, 0}, {10, 20, 5});
    expect_at(v.geometry(), {2, 1, 3}, {12, 21, 12.5});
    EXPECT_EQ(info.format, ScanFormat::dicom);
    EXPECT_EQ(info.series.modality, "CT");
    EXPECT_EQ(info.series.files, 4u);
    EXPECT_TRUE(info.warnings.empty()) << info.warnings[0];
}

// A slice that one file stands for may be in a series of its own, because it does not fit to the others.
TEST(DicomTable, ImagesOfTheSeriesThatAreNotReadAreWarnedOf) {
    const auto warnings_of = [](const fs::path& input) {
        ScanInfo info;
        read_scan(input, {}, &info);
        const ScanReport report = inspect_scan(input);
        EXPECT_EQ(report.series.at(report.chosen.value()).warnings, [&] {
            std::vector<std::string> of_series = info.warnings;
            std::erase_if(of_series, [](const std::string& w) { return w.ends_with("skipped"); });
            return of_series;
        }());
        return info.warnings;
    };
    TemporaryFolder folder;
    write_series(folder, 6);
    EXPECT_TRUE(warnings_of(folder.path()).empty());
    DicomWriter odd = slice(6, 12);
    odd.spacing("0.5\\0.25");
    odd.write(folder / "slice6");
    for (const fs::path& input : {folder / "slice0", folder.path()}) {
        const std::vector<std::string> warnings = warnings_of(input);
        ASSERT_FALSE(warnings.empty());
        contains(warnings.back(), "1 more image of the same series (SeriesInstanceUID), for example '");
    }
    odd.text(0x00080008, "CS", "DERIVED\\LOCALIZER");
    odd.write(folder / "slice6");
    EXPECT_TRUE(warnings_of(folder / "slice0").empty()) << "a scout";
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

TEST(DicomTable, UnevenSlicesAreRefusedByName) {
    TemporaryFolder folder;
    write_series(folder, 6);
    fs::remove(folder / "slice3");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "slice2");
    contains(what, "slice4");
    contains(what, "4 mm");
}

TEST(DicomTable, UnevennessCountsFromAHundredthOfAMillimetreOrOfTheGap) {
    struct Slices {
        double gap, shift;
        bool good;
    };
    for (const auto& [gap, shift, good] :
         {Slices{2, 0.004, true}, {2, 0.02, false}, {0.1, 0.0008, true}, {0.1, 0.0012, false}}) {
        TemporaryFolder folder;
        write_series(folder, 5, "s", [g = gap, s = shift](DicomWriter& w, int k) {
            w.position("0\\0\\" + std::to_string(g * k + (k == 2 ? s : 0)));
        });
        if (good)
            EXPECT_NEAR(read_scan(folder.path()).geometry().spacing[2], gap, 1e-9);
        else
            contains(refusal<GeometryError>(folder.path()), "uneven");
    }
}

// Each pair of values is on either side of a limit between slices of one volume and of others.
TEST(DicomTable, SlicesOfOneVolumeMayDifferALittle) {
    const auto outcome = [](const std::function<void(DicomWriter&, int)>& change) {
        TemporaryFolder folder;
        write_series(folder, 3, "a");  // at 2 mm from each other
        write_series(folder, 3, "b", [&](DicomWriter& s, int k) {
            s.position("10\\20\\" + std::to_string(6 + 2 * k));
            change(s, k);
        });
        const ScanReport report = inspect_scan(folder.path());
        if (report.series.size() != 1) return fmt::format("{} series", report.series.size());
        return report.series[0].refusal.value_or("");
    };
    const auto turned = [&](double radians) {
        return outcome(
            [=](DicomWriter& s, int) { s.orientation(fmt::format("1\\{0}\\0\\-{0}\\1\\0", radians)); });
    };
    EXPECT_EQ(turned(0.0009), "");
    EXPECT_EQ(turned(0.0011), "2 series");
    const auto spacing = [&](double between_rows) {
        return outcome([=](DicomWriter& s, int) { s.spacing(fmt::format("{}\\1", between_rows)); });
    };
    EXPECT_EQ(spacing(1.00009), "");
    EXPECT_EQ(spacing(1.00011), "2 series");
    const auto gap = [&](double length) {
        return outcome(
            [=](DicomWriter& s, int k) { s.position(fmt::format("10\\20\\{}", 4 + length + 2 * k)); });
    };
    contains(gap(19.9), "its slices are uneven");
    EXPECT_EQ(gap(20.1), "2 series");
    const auto sideways = [&](double shift) {
        return outcome([=](DicomWriter& s, int k) {
            s.position(fmt::format("{}\\20\\{}", 10 + (k == 0 ? shift : 0), 6 + 2 * k));
        });
    };
    EXPECT_EQ(sideways(0.019), "");
    contains(sideways(0.021), "its slices are shifted sideways between 'a2' and 'b0'");
}

TEST(DicomTable, SeveralSeriesAreListedAndOneCanBeChosen) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 4, "b", [](DicomWriter& s, int) {
        s.text(0x0020000e, "UI", "1.2.4");
        s.text(0x0008103e, "LO", "lung");
    });
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "there are 2 series: 1 (CT 'lung', 3 x 2 x 4, 4 files), 2 (CT ");
    EXPECT_EQ(what.find("1.2.3"), what.npos) << "people do not read ids: " << what;

    ScanOptions options;
    options.series = "1.2.4";
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options, &info)), volume_samples(4));
    EXPECT_EQ(info.series.description, "lung");
    options.series = "1.2.5";
    contains(refusal<OptionError>(folder.path(), options), "no series '1.2.5'");
    for (const char* name : {"1", "1.2.4"}) {  // its number in the list, its id
        options.series = name;
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(4));
    }
    options.series = "1.2.";  // the first part of both
    contains(refusal<GeometryError>(folder.path(), options), "there are 2 series: 1 (");

    const ScanReport report = inspect_scan(folder.path());
    EXPECT_EQ(report.format, ScanFormat::dicom);
    ASSERT_EQ(report.series.size(), 2u);
    EXPECT_EQ(report.series[0].series.id, "1.2.4");
    EXPECT_EQ(report.series[0].series.dims[2], 4);
    EXPECT_EQ(report.series[1].series.spacing[2], 2);
}

// The longest identifiers, names and numbers of slices must not make a message unreadable.
TEST(DicomTable, MessagesGiveExamplesOfManySeriesAndGaps) {
    TemporaryFolder folder;
    const std::string root(58, '1');
    for (int n = 0; n < 30; ++n) {
        write_series(folder, 3, "series" + std::to_string(n) + "-", [&](DicomWriter& s, int) {
            s.text(0x0020000e, "UI", root + ".10" + std::to_string(10 + n));
            s.text(0x0008103e, "LO", std::string(64, 'x'));
        });
    }
    constexpr std::size_t kLongest = 320;
    const std::string several = refusal<GeometryError>(folder.path());
    contains(several, "30 series");
    contains(several, "options.series");
    contains(several, "inspect_scan");
    EXPECT_LE(several.size(), kLongest) << several;
    ScanOptions options;
    options.series = "none";
    const std::string missing = refusal<OptionError>(folder.path(), options);
    contains(missing, "no series 'none'");
    EXPECT_LE(missing.size(), kLongest) << missing;
    EXPECT_EQ(inspect_scan(folder.path()).series.size(), 30u);
}

TEST(DicomTable, MessagesGiveExamplesOfManyGaps) {
    TemporaryFolder folder;
    write_series(folder, 40, std::string(60, 'f'), [](DicomWriter& s, int k) {
        s.position("0\\0\\" + std::to_string(2.0 * k + (k % 3 == 0 ? 0.5 : 0)));
    });
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "uneven");
    contains(what, "; and ");
    contains(what, " more, elsewhere ");
    EXPECT_LE(what.size(), 350u) << what;
    EXPECT_GT(inspect_scan(folder.path()).series.at(0).gaps.size(), 20u);
}

TEST(DicomTable, OneSeriesIsSplitWhereItsGeometryDiffers) {
    const std::vector<std::pair<const char*, std::function<void(DicomWriter&, int)>>> changes = {
        {"orientation", [](DicomWriter& s, int) { s.orientation("0\\1\\0\\1\\0\\0"); }},
        {"frame of reference", [](DicomWriter& s, int) { s.text(0x00200052, "UI", "1.2.8"); }},
        {"spacing", [](DicomWriter& s, int) { s.spacing("2\\2"); }},
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
        contains(refusal<GeometryError>(folder.path()), "there are 2 series");
        ScanOptions options;
        options.series = "1.2.3/1";
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(4));
    }
}

TEST(DicomTable, ScoutsAreSkipped) {
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

TEST(DicomTable, FilesWithoutAnImageAreSkipped) {
    TemporaryFolder folder;
    DicomWriter report;
    report.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.88.11");
    report.write(folder / "report");
    contains(refusal<InputError>(folder.path()), "report': is a structured report; a scan has images");
    DicomWriter structures;
    structures.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.481.3");
    structures.write(folder / "structures");
    contains(refusal<InputError>(folder.path()), "none of 2 DICOM files holds an image");
    contains(refusal<InputError>(folder / "structures"), "is an RT structure set");
    fs::remove(folder / "report");
    contains(refusal<InputError>(folder.path()), "is an RT structure set");
    write_series(folder, 2);
    contains(refusal<InputError>(folder / "structures"), "is an RT structure set");
    write_file(folder / "notes.txt", "nothing");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(2));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "1 DICOM file holds no image");
}

TEST(DicomTable, EnhancedMultiFrame) {
    TemporaryFolder folder;
    for (const Form form : {Form::explicit_little, Form::explicit_big}) {
        // Programs that do not know the functional groups store them with an unknown VR.
        DicomWriter unknown = enhanced(5, Form::implicit_little);
        unknown.form = form;
        unknown.elements[0x52009229].first = unknown.elements[0x52009230].first = "UN";
        unknown.write(folder / "frames.dcm");
        EXPECT_EQ(read_scan(folder.path()).geometry().spacing, (Vec3d{4, 3, 2}));
    }
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
    contains(refusal<GeometryError>(folder.path()), "options.resample");
    ScanOptions options;
    options.resample = true;
    ScanInfo info;
    const Volume v = read_scan(folder.path(), options, &info);
    // The samples are linear in the position, and so are interpolated ones.
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
    contains(info.warnings[0], "2 duplicate slices are skipped");
}

TEST(DicomTable, DuplicatesWithOtherPixelsAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 4);
    slice(9, 2.0).write(folder / "again");
    slice(8, 6.0).write(folder / "more");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "again' and 'slice1'");
}

TEST(DicomTable, DuplicatesThatDifferInRescaleAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 3);
    DicomWriter other = slice(1, 2.0);
    other.rescale("1", "-1024");
    other.write(folder / "again");
    contains(refusal<GeometryError>(folder.path()), "same position");
}

TEST(DicomTable, ASingleSliceNeedsASpacing) {
    TemporaryFolder folder;
    slice(0, 7).write(folder / "one");
    contains(refusal<GeometryError>(folder.path()),
             "single slice, whose thickness is unknown; set options.spacing to 1,1,Z");
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 2.5};
    const Volume v = read_scan(folder.path(), options);
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(1));
    expect_at(v.geometry(), {1, 1, 1}, {11, 21, 9.5});
}

TEST(DicomTable, SlicesWithoutAPositionNeedASpacing) {
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
        contains(what, "options.spacing");
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

// Without positions, only numbers tell the order of slices: those of two phases would be mixed.
TEST(DicomTable, NumbersOfSlicesWithoutAPositionAreChecked) {
    const auto write = [](const TemporaryFolder& folder, const std::vector<std::string>& numbers) {
        for (std::size_t k = 0; k < numbers.size(); ++k) {
            DicomWriter s = slice(static_cast<int>(k), 0);
            s.elements.erase(0x00200032u);
            if (!numbers[k].empty()) s.text(0x00200013, "IS", numbers[k]);
            s.write(folder / ("s" + std::to_string(k + 8)));  // s8, s9, s10
        }
    };
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const auto& numbers : {std::vector<std::string>{"1", "2", "2"}, {"1", "2", ""}}) {
        const TemporaryFolder folder;
        write(folder, numbers);
        contains(refusal<GeometryError>(folder.path(), options), "do not tell the order");
    }
    ScanInfo info;
    const TemporaryFolder gap;
    write(gap, {"1", "2", "5"});
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(gap.path(), options, &info)), volume_samples(3));
    contains(info.warnings.at(1), "grow by 3 from 's9' to 's10' and by 1 elsewhere");
    const TemporaryFolder none;
    write(none, {"", "", ""});
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(none.path(), options, &info)), volume_samples(3));
    contains(info.warnings.at(0), "by the names of their files");
}

TEST(DicomTable, PositionsThatContradictTheOrientationWarn) {
    const TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int k) {
        s.position("0\\" + std::to_string(2 * k) + "\\" + std::to_string(0.04 * k));
    });
    ScanInfo info;
    const Volume v = read_scan(folder.path(), {}, &info);
    expect_at(v.geometry(), {0, 0, 2}, {0, 4, 0.08});
    contains(info.warnings.at(0), "contradict their orientation");
}

TEST(DicomTable, ASpacingMayNotContradictTheHeaders) {
    TemporaryFolder folder;
    write_series(folder, 3);
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 3};
    contains(refusal<OptionError>(folder.path(), options),
             "1 x 1 x 2 mm, not 1 x 1 x 3; do not set options.spacing");
}

TEST(DicomTable, FramesWithoutAPositionNeedASpacing) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.elements.erase(0x52009230);
    frames.write(folder / "frames.dcm");
    contains(refusal<GeometryError>(folder.path()), "no position");
    ScanOptions options;
    options.spacing = Vec3d{4, 3, 2};
    EXPECT_EQ(read_scan(folder.path(), options).geometry().dims[2], 5);
}

// Each frame is compared with all volumes so far; a malicious file has as many volumes as frames.
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
    contains(refusal<InputError>(folder.path()), "more than 2000 different geometries");
}

TEST(DicomTable, ADifferentFrameIsRefusedOrSplit) {
    // The frames of one file follow the same rules as files.
    TemporaryFolder folder;
    enhanced(6).write(folder / "frames.dcm");
    std::string bytes = read_file(folder / "frames.dcm");
    const std::size_t at = bytes.find("10\\20\\6 ");
    ASSERT_NE(at, bytes.npos);
    bytes.replace(at, 8, "10\\20\\7 ");
    write_file(folder / "frames.dcm", bytes);
    contains(refusal<GeometryError>(folder.path()), "frames.dcm' frame");
}

TEST(DicomTable, TextIsReadInItsCharacterSet) {
    struct Case {
        const char *character_set, *stored, *read;
    };
    testing::internal::CaptureStderr();
    for (const Case& c : {Case{"ISO_IR 100",
                               "Sch\xe4"
                               "del",
                               "Sch\xc3\xa4"
                               "del"},
                          Case{"ISO_IR 192",
                               "Sch\xc3\xa4"
                               "del",
                               "Sch\xc3\xa4"
                               "del"},
                          Case{"ISO_IR 144", "\xbc\xde\xd7\xd3", "\xd0\x9c\xd0\xbe\xd0\xb7\xd0\xb3"},
                          Case{"ISO_IR 6",
                               "Sch\xe4"
                               "del",
                               "Sch?del"},
                          Case{"unknown",
                               "Sch\xe4"
                               "del",
                               "Sch?del"}}) {
        SCOPED_TRACE(c.character_set);
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) {
            s.text(0x00080005, "CS", c.character_set);
            s.text(0x0008103e, "LO", c.stored);
        });
        EXPECT_EQ(inspect_scan(folder.path()).series.at(0).series.description, c.read);
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
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
    contains(info.warnings.at(0), "1 DICOM file holds no image");
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

// The same scan in four formats gives a surface with the same points.
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
