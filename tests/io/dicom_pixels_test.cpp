// The rows about pixels of the DICOM table in docs/reliability.md: rescaling, bits, transfer syntaxes,
// frames.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include <marrow/error.h>

#include "support/compressed_pixels.h"
#include "support/dicom_series.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

TEST(DicomTable, RescaleIsAppliedToEachSlice) {
    TemporaryFolder folder;
    write_series(folder, 3, "s", [](DicomWriter& s, int k) { s.rescale(std::to_string(k + 1), "-1024"); });
    const auto read = samples_of<std::int16_t>(read_scan(folder.path()));
    ASSERT_EQ(read.size(), 18u);
    EXPECT_EQ(read[0], -1024);
    EXPECT_EQ(read[6], 2 * 100 - 1024);
    EXPECT_EQ(read[17], 3 * 212 - 1024);
}

// Where the rescale of all slices has a fraction, 16 bits can stay as they are. All else is as without the
// option.
TEST(DicomTable, FractionsMayStayStored) {
    const auto read = [](const std::function<void(DicomWriter&, int)>& change, bool keep,
                         ScanInfo* info = nullptr) {
        const TemporaryFolder folder;
        write_series(folder, 3, "s", change);
        return read_scan(folder.path(), {.keep_stored = keep}, info);
    };
    const auto by = [](const std::string& slope, const std::string& intercept) {
        return [=](DicomWriter& s, int) {
            s.rescale(slope, intercept);
            s.number(0x00280120, 7);
        };
    };
    for (const auto& [slope, intercept] : {std::pair{"1", "-2643.4"}, {"0.5", "-1024"}, {"2.25", "0.125"}}) {
        ScanInfo info;
        const Volume kept = read(by(slope, intercept), true, &info);
        EXPECT_EQ(samples_of<std::int16_t>(kept), volume_samples(3));
        EXPECT_EQ(kept.rescale(), (Rescale{std::stod(slope), std::stod(intercept)}));
        EXPECT_EQ(info.padding, kept.rescale().value(7));
        const std::vector<float> values = samples_of<float>(read(by(slope, intercept), false));
        ASSERT_EQ(kept.bytes() * 2, values.size() * sizeof(float));
        for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_EQ(static_cast<float>(kept.rescale().value(volume_samples(3)[i])), values[i]);
    }

    const auto bits = [&](int stored, bool is_signed) {
        return [=](DicomWriter& s, int) {
            s.rescale("1", "0.5");
            s.pixel_format(16, stored, is_signed);
        };
    };
    EXPECT_EQ(read(bits(16, true), true).type(), SampleType::int16);
    EXPECT_EQ(read(bits(15, false), true).type(), SampleType::int16);
    EXPECT_EQ(read(bits(16, false), true).type(), SampleType::uint16);
    const Volume large = read(
        [&](DicomWriter& s, int k) {
            bits(16, false)(s, k);
            s.pixels<std::uint16_t>(columns, rows, {0, 1, 32767, 32768, 65534, 65535});
        },
        true);
    EXPECT_EQ(samples_of<std::uint16_t>(large)[5], 65535);

    const auto expect_unchanged = [&](const char* what,
                                      const std::function<void(DicomWriter&, int)>& change) {
        SCOPED_TRACE(what);
        const Volume kept = read(change, true), plain = read(change, false);
        EXPECT_TRUE(kept.rescale().is_identity());
        EXPECT_EQ(kept.type(), plain.type());
        ASSERT_EQ(kept.bytes(), plain.bytes());
        EXPECT_EQ(std::memcmp(kept.data(), plain.data(), kept.bytes()), 0);
    };
    expect_unchanged("whole numbers", by("2", "-1024"));
    expect_unchanged("larger samples have smaller values", by("-0.5", "0"));
    expect_unchanged("slices differ, as in PET",
                     [](DicomWriter& s, int k) { s.rescale(std::to_string(0.5 + 0.25 * k), "0"); });
    expect_unchanged("signed and unsigned 16 bits", [&](DicomWriter& s, int k) { bits(16, k == 1)(s, k); });
}

// Between uneven slices, values are interpolated.
TEST(DicomTable, FractionsOfResampledSlicesBecomeFloat32) {
    const TemporaryFolder folder;
    write_series(folder, 4, "s", [](DicomWriter& s, int k) {
        s.rescale("1", "0.5");
        s.position("10\\20\\" + std::to_string(k == 3 ? 7 : 2 * k));
    });
    const Volume kept = read_scan(folder.path(), {.resample = true, .keep_stored = true});
    EXPECT_TRUE(kept.rescale().is_identity());
    EXPECT_EQ(samples_of<float>(kept), samples_of<float>(read_scan(folder.path(), {.resample = true})));
}

TEST(DicomTable, UnusableRescaleIsRefused) {
    for (const char* slope : {"0", "nan", "x"}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) { s.rescale(slope, "0"); });
        contains(refusal<InputError>(folder.path()), "rescale");
    }
}

// The padding of all slices, as a sample of the volume.
TEST(DicomTable, PaddingIsRescaled) {
    const auto padding = [](const std::function<void(DicomWriter&, int)>& change) {
        const TemporaryFolder folder;
        write_series(folder, 2, "s", change);
        ScanInfo info;
        read_scan(folder.path(), {}, &info);
        return info.padding;
    };
    const auto stored = [](int value, const char* slope) {
        return [=](DicomWriter& s, int) {
            s.number(0x00280120, value);
            s.rescale(slope, "-1024");
        };
    };
    EXPECT_EQ(padding({}), std::nullopt);
    EXPECT_EQ(padding(stored(65536 - 2000, "1")), -3024);
    EXPECT_EQ(padding(stored(7, "0.1")), static_cast<float>(0.1 * 7 - 1024))
        << "as float32, like the samples";
    EXPECT_EQ(padding([](DicomWriter& s, int k) {
                  if (k == 0) s.number(0x00280120, 5);
              }),
              std::nullopt)
        << "one slice of two";
    EXPECT_EQ(padding([](DicomWriter& s, int k) {
                  s.number(0x00280120, 5);
                  s.rescale(std::to_string(k + 1), "0");
              }),
              std::nullopt)
        << "different samples in both slices";
    EXPECT_EQ(padding([](DicomWriter& s, int) {
                  s.pixel_format(16, 16, false);
                  s.number(0x00280120, 40000);
              }),
              40000)
        << "unsigned";
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
    EXPECT_EQ(inspect_scan(folder.path()).series.at(0).warnings, info.warnings);
}

TEST(DicomTable, IntegersOf32BitsKeepAllDigits) {
    TemporaryFolder folder;
    std::vector<double> expected;
    for (int k = 0; k < 2; ++k) {
        DicomWriter s = slice(k, 2.0 * k);
        std::vector<std::int32_t> samples;
        for (int i = 0; i < columns * rows; ++i) samples.push_back(16777217 + 6 * k + i);
        s.pixels(columns, rows, samples);
        s.pixel_format(32, 32, true);
        s.write(folder / std::to_string(k));
        expected.insert(expected.end(), samples.begin(), samples.end());
    }
    EXPECT_EQ(samples_of<double>(read_scan(folder.path())), expected);
}

TEST(DicomTable, CtInOtherUnitsThanHuWarns) {
    for (const auto& [type, in_hu] :
         {std::pair("HU", true), {"US", true}, {"MGML", false}, {"Z_EFF", false}}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&, t = type](DicomWriter& s, int) { s.text(0x00281054, "LO", t); });
        ScanInfo info;
        read_scan(folder.path(), {}, &info);
        ASSERT_EQ(info.warnings.size(), in_hu ? 0u : 1u) << type;
        if (!in_hu) contains(info.warnings[0], std::string("not HU: their unit (RescaleType) is ") + type);
        EXPECT_EQ(inspect_scan(folder.path()).series.at(0).hounsfield, in_hu) << type;
    }
}

TEST(DicomTable, UnusedBitsAreMaskedAndTheSignExtended) {
    TemporaryFolder folder;
    // 12 signed bits in the middle of the cell, bits 2 to 13; the other bits are random.
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

TEST(DicomTable, MoreFramesThanBytesAreRefused) {
    TemporaryFolder folder;
    DicomWriter frames = enhanced(5);
    frames.text(0x00280008, "IS", "6");
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "describe 5 frames, but it has 6");
    frames = enhanced(5);
    frames.elements[0x7fe00010].second.resize(2 * (5 * columns * rows - 1));
    frames.write(folder / "frames.dcm");
    contains(refusal<InputError>(folder.path()), "truncated");
}

TEST(DicomTable, TooManyFramesAreRefusedBeforeAllocation) {
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
            s.fragments = {whole.substr(0, half), whole.substr(half)};  // a frame may have several fragments
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

// Encoders may state all bits of a cell instead of the stored ones.
TEST(DicomTable, StreamsOfMoreBitsThanTheStoredOnesKeepTheirSign) {
    constexpr int width = 4, height = 2;
    const std::vector<std::int16_t> values = {-2048, -1024, -1, 0, 1, 77, 1024, 2047};
    std::vector<std::uint16_t> cells;
    for (const std::int16_t value : values) cells.push_back(static_cast<std::uint16_t>(value & 0xfff));
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const auto& [syntax, stream] :
         {std::pair<std::string, std::string>{"1.2.840.10008.1.2.4.80", jpeg_ls(width, height, cells, 16)},
          {"1.2.840.10008.1.2.4.90", jpeg_2000(width, height, cells, 16)},
          {"1.2.840.10008.1.2.4.57", lossless_jpeg(width, height, cells, 16, 1, false)}}) {
        SCOPED_TRACE(syntax);
        const TemporaryFolder folder;
        DicomWriter s;
        s.pixel_format(16, 12, true);
        s.pixels(width, height, cells);
        s.compressed_syntax = syntax;
        s.fragments = {even(stream)};
        EXPECT_EQ(samples_of<std::int16_t>(read_scan(s.write(folder / "one.dcm"), options)), values);
    }
}

// What is above the stored bits, such as an overlay, is no part of the value, as in uncompressed samples. A
// stream that states a precision of its own is believed.
TEST(DicomTable, StreamsOfMoreBitsThanTheStoredOnesAreMaskedIfTheyFillTheCells) {
    constexpr int width = 4, height = 2;
    const std::vector<std::int16_t> values = {0, 1, 77, 1000, 2047, 2048, 4000, 4095};
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const int bits : {13, 16}) {
        std::vector<std::uint16_t> cells;
        for (const std::int16_t value : values)
            cells.push_back(static_cast<std::uint16_t>(value | 1 << (bits - 1)));
        for (const auto& [syntax, stream] :
             {std::pair<std::string, std::string>{"1.2.840.10008.1.2.4.80",
                                                  jpeg_ls(width, height, cells, bits)},
              {"1.2.840.10008.1.2.4.90", jpeg_2000(width, height, cells, bits)},
              {"1.2.840.10008.1.2.4.57", lossless_jpeg(width, height, cells, bits, 1, false)}}) {
            SCOPED_TRACE(syntax + " of " + std::to_string(bits) + " bits");
            const TemporaryFolder folder;
            DicomWriter s;
            s.pixel_format(16, 12, false);
            s.pixels(width, height, cells);
            s.compressed_syntax = syntax;
            s.fragments = {even(stream)};
            const auto read = samples_of<std::int16_t>(read_scan(s.write(folder / "one.dcm"), options));
            ASSERT_EQ(read.size(), values.size());
            for (std::size_t i = 0; i < values.size(); ++i)
                EXPECT_EQ(read[i], bits == 16 ? values[i] : cells[i]) << i;
        }
    }
}

// Some encoders write zeros for the range of frequencies of a sequential scan.
TEST(DicomTable, SequentialJpegNeedNotStateItsFrequencies) {
    using namespace std::string_literals;
    constexpr int width = 20, height = 12;
    for (const int bits : {8, 12}) {
        DicomWriter s;
        s.pixel_format(bits == 8 ? 8 : 16, bits, false);
        s.pixels(width, height, std::vector<std::uint16_t>(width * height));
        s.compressed_syntax = bits == 8 ? "1.2.840.10008.1.2.4.50" : "1.2.840.10008.1.2.4.51";
        std::string stream = flat_jpeg(width, height, {1, 100, 50, 7, 33, 77}, bits, false);
        const TemporaryFolder folder;
        ScanOptions options;
        options.spacing = Vec3d{1, 1, 1};
        const auto read = [&] {
            s.fragments = {even(stream)};
            return samples_of<std::int16_t>(read_scan(s.write(folder / "one.dcm"), options));
        };
        const std::vector<std::int16_t> expected = read();
        const std::size_t scan = stream.find("\xff\xda\0\x08\x01"s);
        ASSERT_NE(scan, stream.npos);
        ASSERT_EQ(stream.substr(scan + 7, 3), "\0\x3f\0"s);
        stream.replace(scan + 7, 3, "\0\0\0"s);
        EXPECT_EQ(read(), expected);
    }
}

TEST(DicomTable, LossyTransferSyntaxesGiveNearlyTheSamePixels) {
    constexpr int width = 20, height = 12;  // 3 x 2 blocks, incomplete at two sides
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

// Damaged streams end the process within OpenJPEG 2.5.0, under any transfer syntax of JPEG 2000.
TEST(DicomTable, HighThroughputJpeg2000IsReadIfOpenJpegIsSafe) {
    const bool safe = std::string(opj_version()) != "2.5.0";
    constexpr int width = 150, height = 90, bits = 12;
    std::vector<std::uint16_t> samples;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x)
            samples.push_back(
                static_cast<std::uint16_t>(2000 + 1500 * std::sin(0.1 * x) * std::cos(0.07 * y)));
    }
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    for (const char* syntax : {"90", "201", "202", "203"}) {
        for (const bool reversible : {true, false}) {
            SCOPED_TRACE(syntax);
            TemporaryFolder folder;
            DicomWriter s;
            s.pixel_format(16, bits, false);
            s.pixels<std::uint16_t>(width, height, samples);
            s.compressed_syntax = std::string("1.2.840.10008.1.2.4.") + syntax;
            const std::string whole = even(htj2k(width, height, samples, bits, reversible));
            s.fragments = {whole};
            s.write(folder / "one.dcm");
            if (!safe) {
                contains(refusal<InputError>(folder / "one.dcm", options), "high-throughput JPEG 2000");
                continue;
            }
            const auto read = samples_of<std::int16_t>(read_scan(folder / "one.dcm", options));
            for (std::size_t i = 0; i < samples.size(); ++i)
                ASSERT_NEAR(read[i], samples[i], reversible ? 0 : 2) << i;
            s.fragments = {even(whole.substr(0, whole.size() / 2))};
            contains(refusal<InputError>(s.write(folder / "one.dcm"), options), "truncated");
        }
    }
}

// Each scan processes the whole image, so a small file with many scans could take hours.
TEST(DicomTable, JpegOfManyScansIsRefused) {
    TemporaryFolder folder;
    DicomWriter s;
    s.pixel_format(8, 8, false);
    s.pixels(16, 8, std::vector<std::uint8_t>(16 * 8));
    s.compressed_syntax = "1.2.840.10008.1.2.4.55";
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    s.fragments = {even(jpeg_of_many_scans(100))};
    EXPECT_NO_THROW(read_scan(s.write(folder / "one.dcm"), options));
    s.fragments = {even(jpeg_of_many_scans(800))};
    contains(refusal<InputError>(s.write(folder / "one.dcm"), options), "JPEG");
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
    contains(refusal<InputError>(folder.path()), "without an offset table");
}

TEST(DicomTable, UnknownTransferSyntaxAndVideoAreRefusedByName) {
    for (const auto& [uid, name] : {std::pair("1.2.840.10008.1.2.9", "1.2.840.10008.1.2.9"),
                                    std::pair("1.2.840.10008.1.2.4.102", "MPEG-4 video"),
                                    std::pair("1.2.840.10008.1.2.4.94", "JPIP")}) {
        TemporaryFolder folder;
        write_series(folder, 2, "s", [&, uid = uid](DicomWriter& s, int) {
            s.compressed_syntax = uid;
            if (s.compressed_syntax.size() % 2) s.compressed_syntax += '\0';
            s.fragments = {"some bytes"};
        });
        contains(refusal<InputError>(folder.path()), name);
    }
}

// GE's private syntax is implicit.
TEST(DicomTable, PrivateTransferSyntaxesAreRefusedByNameInEitherForm) {
    const std::string uid = "1.2.840.113619.5.2";
    for (const Form form : {Form::implicit_little, Form::explicit_little}) {
        const TemporaryFolder folder;
        write_series(folder, 2, "s", [&](DicomWriter& s, int) { s.form = form; });
        for (const char* name : {"s0", "s1"}) {
            std::string bytes = read_file(folder / name);
            const std::size_t at = bytes.find("1.2.840.10008.1.2");
            ASSERT_NE(at, bytes.npos);
            bytes.replace(at, uid.size(), uid);
            if (form == Form::explicit_little) bytes[at + uid.size()] = '\0';  // it is longer
            write_file(folder / name, bytes);
        }
        contains(refusal<InputError>(folder.path()),
                 "the transfer syntax '" + uid + "', which is not supported");
    }
}

TEST(DicomTable, FloatingPointPixelsAreRefused) {
    for (const std::uint32_t tag : {0x7fe00008u, 0x7fe00009u}) {
        for (const char* sop_class : {"1.2.840.10008.5.1.4.1.1.30", "1.2.840.10008.5.1.4.1.1.4"}) {
            const TemporaryFolder folder;
            DicomWriter s = slice(0, 0);
            s.text(0x00080016, "UI", sop_class);
            s.pixel_format(32, 32, false);
            s.elements.erase(0x7fe00010);
            // Their VRs are OF and OD, which the writer does not know; UN has the same form.
            s.elements[tag] = {"UN", std::string(std::size_t{8} * columns * rows, '\0')};
            s.write(folder / "map");
            for (const fs::path& input : {folder.path(), folder / "map"})
                contains(refusal<InputError>(input), "has floating-point pixels, which are not supported");
        }
    }
}

}  // namespace
}  // namespace marrow::test
