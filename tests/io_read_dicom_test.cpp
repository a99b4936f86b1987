// DICOM, row by row of what can go wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <marrow/error.h>

#include "reading_checks.h"
#include "scan_files.h"

namespace marrow::test {
namespace {

using Form = DicomWriter::Form;

constexpr int columns = 3, rows = 2;

// Samples that tell their place: 100 k + 10 j + i.
std::vector<std::int16_t> slice_samples(int k) {
    std::vector<std::int16_t> out;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) out.push_back(static_cast<std::int16_t>(100 * k + 10 * j + i));
    }
    return out;
}

DicomWriter slice(int k, double z) {
    DicomWriter out;
    out.pixels(columns, rows, slice_samples(k));
    out.position("10\\20\\" + std::to_string(z));
    return out;
}

std::vector<std::int16_t> volume_samples(int slices) {
    std::vector<std::int16_t> out;
    for (int k = 0; k < slices; ++k) {
        const auto s = slice_samples(k);
        out.insert(out.end(), s.begin(), s.end());
    }
    return out;
}

// `count` slices 2 mm apart.
void write_series(const TemporaryFolder& folder, int count, const std::string& prefix = "slice",
                  const std::function<void(DicomWriter&, int)>& change = {}) {
    for (int k = 0; k < count; ++k) {
        DicomWriter s = slice(k, 2.0 * k);
        if (change) change(s, k);
        s.write(folder / (prefix + std::to_string(k)));
    }
}

TEST(ReadDicom, SliceOrderComesFromPositionsNotFromNames) {
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

TEST(ReadDicom, PixelSpacingIsRowThenColumn) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int) { s.spacing("0.5\\0.25"); });
    const Volume v = read_scan(folder.path());
    expect_at(v.geometry(), {1, 0, 0}, {10.25, 20, 0});
    expect_at(v.geometry(), {0, 1, 0}, {10, 20.5, 0});
}

TEST(ReadDicom, ObliqueSlicesLieWhereTheHeaderSays) {
    TemporaryFolder folder;
    // rows run along (0.8, 0.6, 0), columns down (0, 0, -1): the normal is (-0.6, 0.8, 0)
    write_series(folder, 3, "s", [](DicomWriter& s, int k) {
        s.orientation("0.8\\0.6\\0\\0\\0\\-1");
        const double d = 3.0 * (2 - k);  // the file names run against the normal
        s.position(std::to_string(-0.6 * d) + "\\" + std::to_string(0.8 * d) + "\\7");
        s.spacing("2\\1");
        s.pixels(columns, rows, slice_samples(2 - k));
    });
    const Volume v = read_scan(folder.path());
    EXPECT_EQ(samples_of<std::int16_t>(v), volume_samples(3));
    expect_at(v.geometry(), {0, 0, 0}, {0, 0, 7});
    expect_at(v.geometry(), {2, 1, 2}, {1.6 - 3.6, 1.2 + 4.8, 5});
}

TEST(ReadDicom, GantryTiltBecomesAShearedVolume) {
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

TEST(ReadDicom, RescaleIsAppliedToEachSlice) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int k) { s.rescale(std::to_string(k + 1), "-1024"); });
    const auto read = samples_of<std::int16_t>(read_scan(folder.path()));
    ASSERT_EQ(read.size(), 18u);
    EXPECT_EQ(read[0], -1024);
    EXPECT_EQ(read[6], 2 * 100 - 1024);
    EXPECT_EQ(read[17], 3 * 212 - 1024);
}

TEST(ReadDicom, FractionalRescaleGivesFloat) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) { s.rescale("0.5", "0.25"); });
    EXPECT_EQ(samples_of<float>(read_scan(folder.path()))[7], 0.5f * 101 + 0.25f);
}

TEST(ReadDicom, ValuesBeyondInt16GiveFloat) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int k) {
        s.pixel_format(16, 16, false);
        s.pixels<std::uint16_t>(columns, rows,
                                {1, 2, 3, 4, 5, static_cast<std::uint16_t>(k == 1 ? 65535 : 6)});
    });
    const auto read = samples_of<float>(read_scan(folder.path()));
    ASSERT_EQ(read.size(), 12u);
    EXPECT_EQ(read[11], 65535.0f);
    EXPECT_EQ(read[0], 1.0f);
}

TEST(ReadDicom, UnusableRescaleIsRefused) {
    for (const char* slope : {"0", "nan", "x"}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) { s.rescale(slope, "0"); });
        contains(refusal<InputError>(folder.path()), "rescale");
    }
}

TEST(ReadDicom, CtWithoutRescaleWarns) {
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

TEST(ReadDicom, UnusedBitsAreMaskedAndTheSignExtended) {
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

TEST(ReadDicom, Monochrome1KeepsItsValues) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) { s.text(0x00280004, "CS", "MONOCHROME1"); });
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path())), volume_samples(2));
}

TEST(ReadDicom, ColourIsRefused) {
    TemporaryFolder folder;
    write_series(folder, 2, "s", [](DicomWriter& s, int) {
        s.text(0x00280004, "CS", "RGB");
        s.number(0x00280002, 3);
    });
    contains(refusal<InputError>(folder.path()), "colour");
}

TEST(ReadDicom, EveryPlainTransferSyntaxAndRunLengthsGiveTheSameSamples) {
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

TEST(ReadDicom, EightAndThirtyTwoBitSamples) {
    TemporaryFolder narrow, wide;
    write_series(narrow, 2, "s", [](DicomWriter& s, int) {
        s.pixel_format(8, 8, false);
        s.pixels<std::uint8_t>(columns, rows, {0, 1, 127, 128, 254, 255});
    });
    write_series(wide, 2, "s", [](DicomWriter& s, int) {
        s.pixel_format(32, 32, true);
        s.pixels<std::int32_t>(columns, rows, {-100000, -1, 0, 1, 70000, 100000});
    });
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(narrow.path()))[5], 255);
    EXPECT_EQ(samples_of<float>(read_scan(wide.path()))[5], 100000.0f);
}

TEST(ReadDicom, UnevenSlicesAreRefusedByName) {
    TemporaryFolder folder;
    write_series(folder, 6);
    fs::remove(folder / "slice3");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "slice2");
    contains(what, "slice4");
    contains(what, "4 mm");
}

TEST(ReadDicom, UnevennessCountsFromAHundredthOfAMillimetre) {
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

TEST(ReadDicom, SlicesShiftedSidewaysAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 5, "s", [](DicomWriter& s, int k) {
        s.position((k == 2 ? "1\\0\\" : "0\\0\\") + std::to_string(2 * k));
    });
    contains(refusal<GeometryError>(folder.path()), "sideways");
}

TEST(ReadDicom, TwoSlicesAtOnePlaceAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 4);
    slice(9, 2.0).write(folder / "again");
    const std::string what = refusal<GeometryError>(folder.path());
    contains(what, "again");
    contains(what, "slice1");
}

TEST(ReadDicom, SeveralSeriesAreListedAndOneCanBeChosen) {
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

TEST(ReadDicom, OneSeriesIsSplitWhereItsGeometryDiffers) {
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

TEST(ReadDicom, ScoutsAreLeftOut) {
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

TEST(ReadDicom, OneFileStandsForItsSeries) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 4, "b", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    EXPECT_EQ(read_scan(folder / "b2").geometry().dims[2], 4);
    EXPECT_EQ(read_scan(folder / "a0").geometry().dims[2], 3);
}

TEST(ReadDicom, FilesWithoutAnImageAreLeftOut) {
    TemporaryFolder folder;
    DicomWriter report;
    report.write(folder / "report");
    contains(refusal<InputError>(folder.path()), "none of 1 DICOM files holds an image");
    write_series(folder, 2);
    write_file(folder / "notes.txt", "nothing");
    ScanInfo info;
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), {}, &info)), volume_samples(2));
    ASSERT_EQ(info.warnings.size(), 1u);
    contains(info.warnings[0], "1 DICOM files hold no image");
}

TEST(ReadDicom, SlicesWithoutAPlaceAreRefused) {
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) { s.elements.erase(tag); });
        contains(refusal<GeometryError>(folder.path()), tag == 0x00280030u ? "PixelSpacing" : "position");
    }
}

TEST(ReadDicom, UnknownTransferSyntaxIsRefusedByName) {
    TemporaryFolder folder;
    write_series(folder, 2);
    for (int k = 0; k < 2; ++k) {
        const fs::path path = folder / ("slice" + std::to_string(k));
        std::string bytes = read_file(path);
        bytes.replace(bytes.find("1.2.840.10008.1.2.1"), 19, "1.2.840.10008.1.2.9");
        write_file(path, bytes);
    }
    contains(refusal<InputError>(folder.path()), "1.2.840.10008.1.2.9");
}

// Enhanced multi-frame: positions and rescale in the functional groups, not in order.
DicomWriter enhanced(int frames) {
    const auto sequence = [](std::uint32_t tag, const std::string& items) {
        return DicomWriter::element(tag, "SQ", items, Form::explicit_little);
    };
    const auto text = [](std::uint32_t tag, std::string value) {
        if (value.size() % 2 != 0) value += ' ';
        return DicomWriter::element(tag, "DS", value, Form::explicit_little);
    };
    DicomWriter out;
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u, 0x00281052u, 0x00281053u})
        out.elements.erase(tag);
    std::string items;
    std::vector<std::int16_t> all;
    for (int n = 0; n < frames; ++n) {
        const int k = (n * 2 + 1) % frames;
        items += DicomWriter::item(
            sequence(0x00209113, DicomWriter::item(text(0x00200032, "10\\20\\" + std::to_string(2 * k)))) +
            sequence(0x00289145,
                     DicomWriter::item(text(0x00281052, std::to_string(1000 * k)) + text(0x00281053, "1"))));
        const auto samples = slice_samples(k);
        all.insert(all.end(), samples.begin(), samples.end());
    }
    out.elements[0x52009229] = {
        "SQ",
        DicomWriter::item(sequence(0x00209116, DicomWriter::item(text(0x00200037, "1\\0\\0\\0\\1\\0"))) +
                          sequence(0x00289110, DicomWriter::item(text(0x00280030, "3\\4"))))};
    out.elements[0x52009230] = {"SQ", items};
    out.text(0x00280008, "IS", std::to_string(frames));
    out.pixels(columns, rows, all);
    return out;
}

TEST(ReadDicom, EnhancedMultiFrame) {
    TemporaryFolder folder;
    enhanced(5).write(folder / "frames.dcm");
    const Volume v = read_scan(folder / "frames.dcm");
    auto expected = volume_samples(5);
    for (std::size_t i = 0; i < expected.size(); ++i)
        expected[i] = static_cast<std::int16_t>(expected[i] + 1000 * (i / 6));
    EXPECT_EQ(samples_of<std::int16_t>(v), expected);
    expect_at(v.geometry(), {1, 1, 2}, {14, 23, 4});
}

TEST(ReadDicom, FramesWithoutAPlaceAreRefused) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.elements.erase(0x52009230);
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "5 frames without a position");
    frames = enhanced(5);
    frames.text(0x00280008, "IS", "6");
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "describes 5 frames and has 6");
}

TEST(ReadDicom, NonAsciiAndLongPaths) {
    TemporaryFolder folder;
    fs::path deep = "Schädel — 頭";
    for (int i = 0; i < 12; ++i) deep /= std::string(60, 'x');
    for (int k = 0; k < 2; ++k) slice(k, k).write(folder / deep / ("schicht " + std::to_string(k)));
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path())), volume_samples(2));
}

TEST(ReadDicom, NoPatientNameAnywhere) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 3, "b", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    std::string said = refusal<GeometryError>(folder.path());
    ScanOptions options;
    options.series = "1.2.4";
    ScanInfo info;
    read_scan(folder.path(), options, &info);
    said += info.series.description + info.series.id;
    for (const auto& w : info.warnings) said += w;
    EXPECT_EQ(said.find("SECRET"), said.npos);
}

TEST(ReadDicom, TextNamedDcmIsNotDicom) {
    TemporaryFolder folder;
    write_file(folder / "letter.dcm", "Dear colleague,\nthis is not a scan.\n" + std::string(400, '.'));
    contains(refusal<InputError>(folder / "letter.dcm"), "not a DICOM file");
    contains(refusal<InputError>(folder.path()), "none of the folder's 1 files");
}

TEST(ReadDicom, TruncatedAnywhereIsNeverRead) {
    for (const Form form : {Form::explicit_little, Form::implicit_little, Form::explicit_big, Form::deflated,
                            Form::run_length, Form::no_preamble}) {
        SCOPED_TRACE(static_cast<int>(form));
        TemporaryFolder folder;
        DicomWriter writer = slice(0, 0);
        writer.form = form;
        const std::string whole = writer.bytes();
        EXPECT_NO_THROW(read_scan(writer.write(folder / "one")));
        // the last bytes of run lengths and of deflated data are padding and a mark of the end
        const std::size_t padding = form == Form::run_length ? 10 : form == Form::deflated ? 8 : 0;
        for (std::size_t size = 0; size + padding < whole.size(); ++size) {
            write_file(folder / "one", whole.substr(0, size));
            EXPECT_THROW(read_scan(folder / "one"), InputError) << size << " of " << whole.size();
        }
    }
}

TEST(ReadDicom, FlippedBytesNeverCrash) {
    std::uint32_t random = 1;
    const auto next = [&] { return random = random * 1664525u + 1013904223u; };
    for (const DicomWriter& writer : {slice(0, 0), enhanced(3)}) {
        TemporaryFolder folder;
        for (const Form form :
             {Form::explicit_little, Form::implicit_little, Form::run_length, Form::explicit_big}) {
            if (writer.elements.contains(0x52009230) && form != Form::explicit_little) continue;
            DicomWriter w = writer;
            w.form = form;
            const std::string whole = w.bytes();
            for (int n = 0; n < 500; ++n) {
                std::string bytes = whole;
                for (int flip = 0; flip < 3; ++flip)
                    bytes[128 + next() / 16 % (bytes.size() - 128)] = static_cast<char>(next() >> 24);
                write_file(folder / "one", bytes);
                try {
                    read_scan(folder / "one");
                } catch (const Error&) {  // anything else fails the test
                }
            }
        }
    }
}

TEST(ReadDicom, ProgressGrowsAndStops) {
    TemporaryFolder folder;
    write_series(folder, 8);
    double last = 0;
    ScanOptions options;
    options.progress = [&](double fraction) {
        EXPECT_GE(fraction, last);
        last = fraction;
        return true;
    };
    read_scan(folder.path(), options);
    EXPECT_EQ(last, 1);
    for (int calls = 1; calls <= 18; ++calls) {  // a beginning and 8 files, twice
        int left = calls;
        options.progress = [&](double) { return --left > 0; };
        options.threads = calls % 2 + 1;
        EXPECT_THROW(read_scan(folder.path(), options), Cancelled) << calls;
    }
}

TEST(ReadDicom, ThreadsDoNotChangeTheResult) {
    TemporaryFolder folder;
    write_series(folder, 17);
    for (const int threads : {1, 2, 3, 7}) {
        ScanOptions options;
        options.threads = threads;
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), volume_samples(17));
    }
}

}  // namespace
}  // namespace marrow::test
