/// The command `marrow INPUT --labels`: extracts a surface for each label of a map.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "steps.h"
#include "surface_job.h"

namespace marrow::apps {

struct LabelsOptions {
    SurfaceJobOptions job;
    bool segmentation = false;  ///< of DICOM or 3D Slicer
    std::optional<CropBox> crop;
    std::filesystem::path table;      ///< names and colours; empty: none
    int relax = 40;                   ///< smoothing passes
    std::optional<std::string> only;  ///< the labels to write, by number or name; none: all
};

/// Declares --labels, --relax and --only.
void add_options(Arguments& arguments, LabelsOptions& options);

/// \throw UsageError an output that cannot be written
void check(const LabelsOptions& options);

/// Extracts, writes, draws and reports the surfaces. \throw EmptySurface the map contains only background
void run(const LabelsOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
