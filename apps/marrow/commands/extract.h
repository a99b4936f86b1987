/// The command `marrow INPUT --isovalue N`: extracts isosurfaces of a scan.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <marrow/tissue_presets.h>

#include "steps.h"
#include "surface_job.h"
#include "trust_steps.h"

namespace marrow::apps {

/// One surface to extract: at `isovalue`, at `preset`, or by Otsu's method if both are absent.
struct SurfaceRequest {
    std::string name;  ///< replaces {name} in the output; as given on the command line
    std::optional<double> isovalue = {};
    const Preset* preset = nullptr;

    /// Nothing for Otsu's method, which needs the scan.
    std::optional<double> known_isovalue() const;
};

struct ExtractOptions {
    SurfaceJobOptions job;
    std::vector<SurfaceRequest> isovalues, presets;
    bool open = false;
    double snap = 0;        ///< as IsosurfaceOptions::snap
    bool topology = false;  ///< as IsosurfaceOptions::topology
    TrustSteps trust;
    FilterSteps filters;
    SurfaceSteps steps;
    std::string device = kCpu;  ///< as gpu::choose_device() takes it

    /// All surfaces, in the order in which they are written.
    std::vector<SurfaceRequest> surfaces() const;
};

/// Declares which surfaces to extract.
void add_surface_options(Arguments& arguments, ExtractOptions& options);

/// Declares the steps before and after extraction.
void add_step_options(Arguments& arguments, ExtractOptions& options);

/// \throw UsageError options that make no sense together
void check(const ExtractOptions& options);

/// Extracts, writes, draws and reports the surfaces. \throw EmptySurface, and as read_scan and write_meshes
void run(const ExtractOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
