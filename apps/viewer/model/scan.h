/// An opened scan and what the viewer knows about its samples.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include <marrow/histogram.h>
#include <marrow/scan_io.h>
#include <marrow/volume.h>

namespace marrow::viewer {

struct Scan {
    std::filesystem::path input;  ///< absolute
    ScanOptions options;          ///< used to read it, without the progress function
    Volume volume;
    ScanInfo info;
    Histogram histogram;
    std::optional<double> otsu;  ///< nothing if all samples are equal
    bool hounsfield = false;     ///< the samples are in HU, so the tissue presets apply
};

/// The absolute path of a file or folder, without "." and ".." and without a slash at its end. Links to
/// folders are resolved, because what follows ".." is beside the folder that a link leads to.
std::filesystem::path absolute_path(const std::filesystem::path& path);

/// Reads a scan and computes its histogram. \throw as read_scan
std::shared_ptr<const Scan> open_scan(const std::filesystem::path& input, const ScanOptions& options);

/// The value of the sample at an index. \pre the index is inside
double sample_at(const Volume& volume, std::int64_t i, std::int64_t j, std::int64_t k);

/// The index of a position, which may be fractional: the inverse of Geometry::physical.
Vec3d index_of(const Geometry& geometry, const Vec3d& position);

}  // namespace marrow::viewer
