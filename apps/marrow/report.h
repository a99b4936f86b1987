// What the command line says about its results.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "steps.h"

namespace marrow {

/// How large a label is, and its surface.
struct LabelVolume {
    std::int64_t samples = 0;
    double samples_mm3 = 0, enclosed_mm3 = 0;

    /// What the surface encloses beside the samples, %.
    double change() const { return 100 * (enclosed_mm3 / samples_mm3 - 1); }
};

/// One extracted surface.
struct Surface {
    std::string name;
    double isovalue = 0;
    Mesh mesh;
    std::filesystem::path output;        ///< empty: not written
    std::vector<StepReport> steps = {};  ///< what was done to it
    /// Written slab by slab: only its size is known, and the mesh is empty.
    struct Size {
        std::uint64_t points = 0, triangles = 0;
    };
    std::optional<Size> in_slabs = {};
    std::optional<std::array<double, 3>> colour = {};  ///< red, green, blue from 0 to 1
    std::optional<std::int64_t> label = {};            ///< of a label map, instead of the isovalue
    LabelVolume label_volume = {};                     ///< with a label

    Size size() const { return in_slabs.value_or(Size{mesh.points.size(), mesh.triangles.size()}); }
};

/// How long each stage took, on the wall.
struct StageSeconds {
    double read = 0;
    double filter = 0;
    double extract = 0;
    double refine = 0;
    double write = 0;  ///< meshes and picture
    double verify = 0;
    double total = 0;
};

/// Prints one JSON object. With one surface its numbers stand beside the rest; with several, in the array
/// `surfaces`. Bounds are in `space`, as written.
void print_json(std::ostream& out, const ScanInfo& info, const std::vector<Surface>& surfaces, Space space,
                const std::vector<std::string>& warnings, const StageSeconds& seconds);

/// Prints one line a surface, and one below for each step that changed it.
void print_text(std::ostream& out, const std::vector<Surface>& surfaces);

/// What `marrow info` found in one input.
struct Finding {
    std::filesystem::path input;
    ScanReport report;
    std::string refusal;  ///< why there is no report; empty: there is
};

/// Prints findings as text; those without a report are left out.
void print_findings(std::ostream& out, const std::vector<Finding>& findings, bool show_patient);

/// Prints them as one JSON object: that of the input, or an array `inputs` of several.
void print_findings_json(std::ostream& out, const std::vector<Finding>& findings, bool show_patient);

}  // namespace marrow
