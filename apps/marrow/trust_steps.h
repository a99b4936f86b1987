/// Says with a surface how far it can be trusted: the options --trust, --keep-thin and --no-alarm.
#pragma once

#include <optional>
#include <string>

#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>

#include "results.h"
#include "shared/arguments.h"

namespace marrow::apps {

struct TrustSteps {
    bool report = false;     ///< --trust
    bool keep_thin = false;  ///< --keep-thin
    bool no_alarm = false;   ///< --no-alarm

    /// Walls are looked for where they matter: in bone, or to keep them.
    bool look_for_walls(bool is_bone) const { return keep_thin || (is_bone && !no_alarm); }
};

void add_trust_options(Arguments& arguments, TrustSteps& steps);

/// \throw UsageError steps that contradict each other
void check_trust(const TrustSteps& steps);

/// Finds thin walls beside a surface that was just extracted with `options`, which have a progress. To keep
/// them, extracts it again with them.
void look_for_thin_walls(Surface& surface, const Volume& scan, const NoiseEstimate& noise,
                         std::optional<double> padding, bool keep, IsosurfaceOptions options);

/// Reports on the points of a finished surface. `hounsfield`: the samples are HU, so the step is 100.
void add_trust(Surface& surface, const Volume& scan, bool hounsfield, TrustOptions options);

/// Gives an object what is written with the points of its surface. It borrows the surface.
void add_point_data(const Surface& surface, MeshObject& object);

/// The lines of the summary; empty without results.
std::string trust_lines(const Surface& surface);

/// Warns of walls that were found and not restored.
std::optional<std::string> thin_wall_warning(const Surface& surface, Space space);

}  // namespace marrow::apps
