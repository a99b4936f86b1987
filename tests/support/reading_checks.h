// What the reading tests ask of a scan.
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

inline void expect_at(const Geometry& g, const Vec3d& index, const Vec3d& place, double tolerance = 1e-9) {
    const Vec3d p = g.physical(index);
    for (int row = 0; row < 3; ++row) EXPECT_NEAR(p[row], place[row], tolerance) << "coordinate " << row;
}

/// The message of the error E that reading throws; empty where it throws nothing.
template <class E>
std::string refusal(const std::filesystem::path& path, const ScanOptions& options = {}) {
    try {
        read_scan(path, options);
    } catch (const E& error) {
        const std::string what = error.what();
        EXPECT_EQ(what.find('\n'), what.npos) << "one line: " << what;
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

/// A scan of the test data, which lie where MARROW_TEST_DATA says; skips the test where there are none.
#define MARROW_TEST_SCAN(variable, name)                                      \
    const char* const variable##_root = std::getenv("MARROW_TEST_DATA");      \
    const std::filesystem::path variable =                                    \
        std::filesystem::path(variable##_root ? variable##_root : "") / name; \
    if (!variable##_root || !std::filesystem::exists(variable))               \
    GTEST_SKIP() << "no " << name << " in MARROW_TEST_DATA"

}  // namespace marrow::test
