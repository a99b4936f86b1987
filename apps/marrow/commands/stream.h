/// The command `marrow INPUT --max-memory SIZE`: extracts an isosurface slab by slab.
#pragma once

#include <cstddef>
#include <optional>

#include "extract.h"

namespace marrow::apps {

struct StreamOptions {
    SurfaceJobOptions job;
    SurfaceRequest surface;  ///< with an isovalue
    bool open = false;
    bool topology = false;              ///< as IsosurfaceOptions::topology
    std::optional<std::size_t> memory;  ///< bytes to stay within
};

/// Declares --max-memory, the only option that extraction does not have.
void add_options(Arguments& arguments, StreamOptions& options);

/// \throw UsageError options that make no sense together
void check(const StreamOptions& options);

/// Reads, extracts and writes slab by slab. \throw EmptySurface, and as open_slices and SurfaceWriter
void run(const StreamOptions& options, const Console& console, const std::atomic<bool>& stop);

}  // namespace marrow::apps
