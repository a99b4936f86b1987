// What was opened.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include <marrow/histogram.h>
#include <marrow/scan_io.h>
#include <marrow/volume.h>

namespace marrow::viewer {

struct Scan {
    std::filesystem::path input;
    ScanOptions options;  ///< it was read with; without progress
    Volume volume;
    ScanInfo info;
    Histogram histogram;
    std::optional<double> otsu;  ///< none where all samples are alike
    bool hounsfield = false;     ///< presets apply, as on the command line
};

/// Reads a scan and looks at its samples. \throw as read_scan
std::shared_ptr<const Scan> open_scan(const std::filesystem::path& input, const ScanOptions& options);

/// The sample at an index; the indices must be inside.
double sample_at(const Volume& volume, std::int64_t i, std::int64_t j, std::int64_t k);

/// The (fractional) index of a position: the inverse of Geometry::physical.
Vec3d index_of(const Geometry& geometry, const Vec3d& position);

}  // namespace marrow::viewer
