// DICOM cases that are not in the tables of docs/reliability.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <marrow/error.h>

#include "support/compressed_pixels.h"
#include "support/dicom_series.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

TEST(ReadDicom, ObliqueSlicesHaveThePositionsOfTheHeader) {
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

TEST(ReadDicom, TheLimitsOfInt16AreKeptAndOneMoreGivesFloat) {
    for (const int bits : {16, 32}) {
        for (const int slope : {1, -1, 16384, 16385, -32767}) {
            for (const int limit : {-32768, 32767}) {
                for (const int more : {0, limit > 0 ? 1 : -1}) {
                    SCOPED_TRACE(testing::Message() << bits << " bits, " << slope << ", " << limit + more);
                    const int intercept = limit + more - slope;
                    TemporaryFolder folder;
                    write_series(folder, 2, "s", [&](DicomWriter& s, int) {
                        s.pixel_format(bits, bits, true);
                        if (bits == 16)
                            s.pixels<std::int16_t>(columns, rows, {0, 0, 0, 0, 0, 1});
                        else
                            s.pixels<std::int32_t>(columns, rows, {0, 0, 0, 0, 0, 1});
                        s.rescale(std::to_string(slope), std::to_string(intercept));
                    });
                    const Volume read = read_scan(folder.path());
                    const bool fits =
                        more == 0 && intercept >= -32768 && intercept <= 32767;  // for samples 0 and 1
                    ASSERT_EQ(read.type(), fits ? SampleType::int16 : SampleType::float32);
                    if (fits)
                        EXPECT_EQ(read.samples<std::int16_t>()[5], limit);
                    else
                        EXPECT_EQ(read.samples<float>()[5], static_cast<float>(limit + more));
                }
            }
        }
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

TEST(ReadDicom, SlicesShiftedSidewaysAreRefused) {
    TemporaryFolder folder;
    write_series(folder, 5, "s", [](DicomWriter& s, int k) {
        s.position((k == 2 ? "1\\0\\" : "0\\0\\") + std::to_string(2 * k));
    });
    contains(refusal<GeometryError>(folder.path()), "sideways");
}

TEST(ReadDicom, OneFileStandsForItsSeries) {
    TemporaryFolder folder;
    write_series(folder, 3, "a");
    write_series(folder, 4, "b", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    EXPECT_EQ(read_scan(folder / "b2").geometry().dims[2], 4);
    EXPECT_EQ(read_scan(folder / "a0").geometry().dims[2], 3);
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
    contains(refusal<InputError>(folder.path()), "the folder's only file is not DICOM or an image");
}

TEST(ReadDicom, TruncatedAnywhereIsNeverRead) {
    for (const Form form : {Form::explicit_little, Form::implicit_little, Form::explicit_big, Form::deflated,
                            Form::run_length, Form::no_preamble}) {
        SCOPED_TRACE(static_cast<int>(form));
        TemporaryFolder folder;
        DicomWriter writer = slice(0, 0);
        writer.form = form;
        const std::string whole = writer.bytes();
        ScanOptions options;
        options.spacing = Vec3d{1, 1, 1};
        EXPECT_NO_THROW(read_scan(writer.write(folder / "one"), options));
        // The last bytes of run lengths and of deflated data are padding and an end mark.
        const std::size_t padding = form == Form::run_length ? 10 : form == Form::deflated ? 8 : 0;
        for (std::size_t size = 0; size + padding < whole.size(); ++size) {
            write_file(folder / "one", whole.substr(0, size));
            EXPECT_THROW(read_scan(folder / "one", options), InputError) << size << " of " << whole.size();
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
                    ScanOptions options;
                    if (n % 2) options.spacing = Vec3d{1, 1, 1};
                    read_scan(folder / "one", options);
                } catch (const Error&) {  // any other exception fails the test
                }
            }
        }
    }
}

TEST(ReadDicom, InspectingAFolderReportsProgressAndStops) {
    TemporaryFolder folder;
    write_series(folder, 4, "a/s");
    write_series(folder, 4, "b/s", [](DicomWriter& s, int) { s.text(0x0020000e, "UI", "1.2.4"); });
    slice(3, 6).write(folder / "b/again");  // a duplicate, whose pixels are compared
    ScanOptions options;
    options.threads = 1;
    int calls = 0;
    double last = 0;
    options.progress = [&](double fraction) {
        EXPECT_GE(fraction, last);
        last = fraction;
        ++calls;
        return true;
    };
    EXPECT_EQ(inspect_scan(folder.path(), options).series.size(), 2u);
    EXPECT_EQ(last, 1);
    EXPECT_GT(calls, 9 + 9 + 9);  // each file is listed, recognized and read
    for (int stop = 1; stop <= calls; ++stop) {
        int left = stop;
        options.progress = [&](double) { return --left > 0; };
        EXPECT_THROW(inspect_scan(folder.path(), options), Cancelled) << stop;
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
    for (int calls = 1; calls <= 18; ++calls) {  // the start and 8 files, twice
        int left = calls;
        options.progress = [&](double) { return --left > 0; };
        options.threads = calls % 2 + 1;
        EXPECT_THROW(read_scan(folder.path(), options), Cancelled) << calls;
    }
}

TEST(ReadDicom, CompressedFramesOfOneFileReportProgressAndStop) {
    constexpr int width = 16, height = 8, count = 12;
    TemporaryFolder folder;
    DicomWriter frames;
    frames.elements.erase(0x00200032);
    frames.text(0x00280008, "IS", std::to_string(count));
    frames.pixels(width, height, std::vector<std::int16_t>(width * height * count));
    frames.pixel_format(16, 12, false);
    frames.compressed_syntax = "1.2.840.10008.1.2.4.80";
    std::vector<std::int16_t> expected;
    for (int k = 0; k < count; ++k) {
        std::vector<std::uint16_t> samples;
        for (int i = 0; i < width * height; ++i) samples.push_back(static_cast<std::uint16_t>(100 * k + i));
        frames.fragments.push_back(even(jpeg_ls(width, height, samples, 12)));
        expected.insert(expected.end(), samples.begin(), samples.end());
    }
    frames.write(folder / "frames.dcm");
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const int threads : {1, 2}) {
        options.threads = threads;
        double last = 0;
        int calls = 0;
        options.progress = [&](double fraction) {
            EXPECT_GE(fraction, last);
            last = fraction;
            ++calls;
            return true;
        };
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(folder.path(), options)), expected);
        EXPECT_EQ(last, 1);
        EXPECT_GE(calls, count);
        for (int stop = 1; stop <= calls; ++stop) {
            int left = stop;
            options.progress = [&](double) { return --left > 0; };
            EXPECT_THROW(read_scan(folder.path(), options), Cancelled) << stop;
        }
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
