// Damaged files of every format: none crashes the reader, and no truncated file is read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include <marrow/error.h>

#include "support/reading_checks.h"
#include "support/small_scans.h"

namespace marrow::test {
namespace {

class Random {
  public:
    std::size_t below(std::size_t limit) {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<std::size_t>(state_ >> 33) % limit;
    }

  private:
    std::uint64_t state_ = 1;
};

ScanOptions options_for(const SmallScan& scan) {
    ScanOptions options;
    options.threads = 1;
    if (scan.needs_spacing) options.spacing = Vec3d{1, 1, 1};
    return options;
}

// A separate header may lose its last newline without harm.
bool holds_samples(const std::string& file) {
    return !file.ends_with(".nhdr") && !file.ends_with(".mhd");
}

constexpr std::size_t kPerKind = 10000 / 2;

TEST(DamagedFiles, UndamagedScansAreRead) {
    for (const SmallScan& scan : small_scans()) {
        SCOPED_TRACE(scan.name);
        TemporaryFolder folder;
        scan.write(folder.path());
        EXPECT_NO_THROW(read_scan(folder / scan.name, options_for(scan)));
    }
}

TEST(DamagedFiles, TruncatedFilesAreNeverRead) {
    Random random;
    const auto scans = small_scans();
    testing::internal::CaptureStderr();
    for (const SmallScan& scan : scans) {
        SCOPED_TRACE(scan.name);
        TemporaryFolder folder;
        scan.write(folder.path());
        for (std::size_t n = 0; n <= kPerKind / scans.size(); ++n) {
            auto file = scan.files.begin();
            std::advance(file, random.below(scan.files.size()));
            const auto& [name, whole] = *file;
            const std::size_t size = random.below(whole.size() - scan.tail);
            write_file(folder / name, whole.substr(0, size));
            try {
                read_scan(folder / scan.name, options_for(scan));
                EXPECT_FALSE(holds_samples(name)) << name << " cut to " << size << " of " << whole.size();
            } catch (const Error&) {  // any other exception fails the test
            }
            write_file(folder / name, whole);
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(DamagedFiles, FlippedBytesNeverCrash) {
    Random random;
    const auto scans = small_scans();
    testing::internal::CaptureStderr();
    for (const SmallScan& scan : scans) {
        SCOPED_TRACE(scan.name);
        TemporaryFolder folder;
        scan.write(folder.path());
        for (std::size_t n = 0; n <= kPerKind / scans.size(); ++n) {
            auto file = scan.files.begin();
            std::advance(file, random.below(scan.files.size()));
            const auto& [name, whole] = *file;
            std::string bytes = whole;
            for (std::size_t flips = 1 + random.below(4); flips > 0; --flips)
                bytes[random.below(bytes.size())] = static_cast<char>(random.below(256));
            write_file(folder / name, bytes);
            try {
                read_scan(folder / scan.name, options_for(scan));
            } catch (const Error& error) {
                const std::string what = error.what();
                EXPECT_EQ(std::count_if(what.begin(), what.end(),
                                        [](unsigned char c) { return c < 0x20 || c == 0x7f; }),
                          0)
                    << what;
            }
            write_file(folder / name, whole);
        }
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(DamagedFiles, ADamagedSliceIsNotSkipped) {
    TemporaryFolder folder;
    for (const SmallScan& scan : small_scans()) {
        if (scan.name == "dicom") scan.write(folder.path());
    }
    // The last slice: without it, the others are a valid volume.
    const std::string whole = read_file(folder / "dicom/3");
    write_file(folder / "dicom/3", whole.substr(0, 400));
    contains(refusal<InputError>(folder / "dicom"), "dicom/3");
    const ScanReport report = inspect_scan(folder / "dicom");
    EXPECT_FALSE(report.chosen);
    contains(report.reason, "dicom/3");
}

}  // namespace
}  // namespace marrow::test
