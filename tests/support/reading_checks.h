/// Checks of the scans that tests read.
#pragma once

#include <gtest/gtest.h>

#include <marrow/scan_io.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::test {

template <class T>
std::vector<T> samples_of(const Volume& volume) {
    EXPECT_EQ(volume.type(), sample_type_of<T>()) << sample_type_name(volume.type());
    if (volume.type() != sample_type_of<T>()) return {};
    return {volume.samples<T>(), volume.samples<T>() + volume.geometry().sample_count()};
}

inline void expect_at(const Geometry& g, const Vec3d& index, const Vec3d& position, double tolerance = 1e-9) {
    const Vec3d p = g.physical(index);
    for (int row = 0; row < 3; ++row) EXPECT_NEAR(p[row], position[row], tolerance) << "coordinate " << row;
}

/// The message of the error E that reading must throw: one line of at most about 300 characters.
template <class E>
std::string refusal(const std::filesystem::path& path, const ScanOptions& options = {}) {
    try {
        read_scan(path, options);
    } catch (const E& error) {
        const std::string what = error.what();
        EXPECT_EQ(what.find('\n'), what.npos) << "one line: " << what;
        EXPECT_LE(what.size(), 350u) << what;
        return what;
    }
    ADD_FAILURE() << path << " was read";
    return {};
}

inline bool contains(const std::string& text, const std::string& part) {
    if (text.find(part) != text.npos) return true;
    ADD_FAILURE() << '"' << part << "\" is not in: " << text;
    return false;
}

/// Declares the path of a scan in the folder MARROW_TEST_DATA, and skips the test if it is missing.
#define MARROW_TEST_SCAN(variable, name)                                      \
    const char* const variable##_root = std::getenv("MARROW_TEST_DATA");      \
    const std::filesystem::path variable =                                    \
        std::filesystem::path(variable##_root ? variable##_root : "") / name; \
    if (!variable##_root || !std::filesystem::exists(variable))               \
    GTEST_SKIP() << "no " << name << " in MARROW_TEST_DATA"

}  // namespace marrow::test
