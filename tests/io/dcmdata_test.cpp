// Why DCMTK's dcmdata has not replaced our parser of data sets: what both do with the same bytes. When DCMTK
// passes a test here, that reason is gone; see "How the decoders were chosen" in docs/reliability.md.
#include <gtest/gtest.h>

#include <cstdlib>

#include <sys/resource.h>
#include <sys/wait.h>

#define HAVE_CONFIG_H  // required by DCMTK's headers
#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcrledec.h>
#include <dcmtk/oflog/oflog.h>

#include <marrow/error.h>

#include "support/dicom_series.h"
#include "support/reading_checks.h"

namespace marrow::test {
namespace {

// A CT whose sequences hold each other, 20 bytes for each.
std::string deep_file(int depth) {
    const std::string item = bytes_of(std::uint16_t{0xfffe}) + bytes_of(std::uint16_t{0xe000});
    const std::string sequence = bytes_of(std::uint16_t{0x0008}) + bytes_of(std::uint16_t{0x1140}) + "SQ" +
                                 std::string(2, '\0') + bytes_of(~std::uint32_t{0}) + item +
                                 bytes_of(~std::uint32_t{0});
    std::string out = slice(0, 0).bytes().substr(0, 132);
    out += DicomWriter::element(0x00020010, "UI", std::string("1.2.840.10008.1.2.1") + '\0',
                                Form::explicit_little);
    out += DicomWriter::element(0x00080016, "UI", std::string("1.2.840.10008.5.1.4.1.1.2") + '\0',
                                Form::explicit_little);
    for (int i = 0; i < depth; ++i) out += sequence;
    return out;
}

TEST(WhyNotDcmdata, DeepSequencesEndTheProcess) {
    const TemporaryFolder folder;
    const fs::path path = write_file(folder / "deep.dcm", deep_file(20000));
    EXPECT_EQ(fs::file_size(path) / 1000, 400);
    contains(refusal<InputError>(path), "damaged");
#ifdef DCMTK_MAX_SEQUENCE_NESTING
    GTEST_SKIP() << "this DCMTK limits how deep sequences may be";
#else
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto load = [&] {
        const rlimit usual{8 << 20, 8 << 20};  // of the stack, which may be unlimited here
        setrlimit(RLIMIT_STACK, &usual);
        OFLog::configure(OFLogger::OFF_LOG_LEVEL);
        DcmFileFormat().loadFile(path.c_str());
        std::_Exit(0);
    };
    EXPECT_EXIT(
        load(), [](int status) { return !WIFEXITED(status) || WEXITSTATUS(status) != 0; }, "");
#endif
}

// PS3.5, annex G.3.2: "if n = -128, output nothing". DCMTK repeats the next byte 129 times.
TEST(WhyNotDcmdata, ACodeOfRunLengthsIsMisread) {
    std::string runs("\x80\x02\x01\x02\x03", 5);
    DcmRLEDecoder decoder(200);
    ASSERT_TRUE(decoder.decompress(runs.data(), runs.size()).good());
    EXPECT_EQ(decoder.size(), 129u + 2u);

    const TemporaryFolder folder;
    DicomWriter s;
    s.pixel_format(8, 8, false);
    s.pixels<std::uint8_t>(3, 1, {1, 2, 3});
    s.compressed_syntax = "1.2.840.10008.1.2.5";
    std::string stream = bytes_of(std::uint32_t{1}) + bytes_of(std::uint32_t{64});
    stream.resize(64);
    s.fragments = {stream + runs + '\0'};
    ScanOptions options;
    options.spacing = Vec3d{1, 1, 1};
    EXPECT_EQ(samples_of<std::int16_t>(read_scan(s.write(folder / "one.dcm"), options)),
              (std::vector<std::int16_t>{1, 2, 3}));
}

}  // namespace
}  // namespace marrow::test
