/// What the commands find: the numbers that reports print.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <marrow/gpu.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/mesh_check.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>
#include <marrow/terrain.h>
#include <marrow/thin_walls.h>

#include "shared/console.h"
#include "shared/surface_trust.h"

namespace marrow::apps {

/// The volume of a label and of its surface.
struct LabelVolume {
    std::int64_t samples = 0;
    double samples_mm3 = 0, enclosed_mm3 = 0;

    /// The difference of the enclosed volume from that of the samples, %.
    double change() const { return 100 * (enclosed_mm3 / samples_mm3 - 1); }
};

/// A surface before or after a step.
struct StepSurface {
    std::int64_t triangles = 0;
    AreaAndVolume size;
    std::optional<MeshMeasures> measures;  ///< for the report in JSON, as they take longer
};

/// The effect of one step on a surface.
struct StepReport {
    std::string name;  ///< "components", "smooth" or "reduce"
    StepSurface before, after;
    std::optional<MeshDistance> deviation;  ///< of the surface after from the one before, if it was measured
    std::optional<MeshDistance> moved;      ///< how far smoothing moved the points
    /// Points that smoothing held back, or collapses that reduction undid, because the surface would have
    /// passed through itself.
    std::int64_t held_back = 0;
    bool encloses_volume = true;  ///< the surface is closed
    std::string note;             ///< what the user must know; empty: nothing
};

/// Walls that the scan is too coarse for.
struct VanishedWalls {
    ThinWalls found;
    bool restored = false;
    bool noise_is_known = true;  ///< else some of them may be noise
};

/// The name of the device that is none.
inline constexpr const char* kCpu = "cpu";

/// One extracted surface.
struct Surface {
    std::string name;
    double isovalue = 0;
    Mesh mesh;
    std::filesystem::path output;        ///< empty: not written
    std::vector<StepReport> steps = {};  ///< what was done to it
    /// If a surface was written slab by slab, only its size is known, and the mesh is empty.
    struct Size {
        std::uint64_t points = 0, triangles = 0;
    };
    std::optional<Size> in_slabs = {};
    std::optional<std::array<double, 3>> colour = {};  ///< red, green, blue from 0 to 1
    std::optional<std::int64_t> label = {};            ///< in a label map, instead of the isovalue
    LabelVolume label_volume = {};                     ///< with a label
    std::int64_t held_back = 0;                        ///< points, by the relaxation of labels
    std::optional<SurfaceTrust> trust = {};            ///< if it was asked for
    std::optional<VanishedWalls> thin_walls = {};      ///< if they were looked for
    std::optional<MeshMeasures> measures = {};         ///< of the mesh, if it was measured
    std::string device = kCpu;                         ///< where it was extracted: the name of a GPU, or kCpu

    Size size() const { return in_slabs.value_or(Size{mesh.points.size(), mesh.triangles.size()}); }
};

/// The wall-clock time of each stage, in seconds.
struct StageSeconds {
    double read = 0;
    double filter = 0;
    double extract = 0;
    double refine = 0;
    double write = 0;  ///< meshes and picture
    double verify = 0;
    double total = 0;
};

/// All that a command found that makes surfaces of a scan.
struct SurfaceResults {
    ScanInfo info;
    std::vector<Surface> surfaces;
    std::vector<std::string> warnings;
    std::optional<std::uint64_t> verified = {};  ///< triangles that were read back and equal; none: not asked
    StageSeconds seconds;
};

/// What the samples of a scan are.
struct SampleReport {
    SampleType type{};
    Rescale rescale;
    double lower = 0, upper = 0;     ///< the range of the finite values
    std::int64_t finite = 0;         ///< samples that are neither NaN nor infinite
    bool may_be_hounsfield = false;  ///< by the headers, or if they do not say, by the lowest sample
    struct Label {
        std::int64_t label = 0, samples = 0;
        std::optional<std::string> name = {};  ///< of the segment
    };
    std::vector<Label> labels;  ///< of a label map, in order; else empty
};

/// An error and its exit code.
struct Failure {
    std::string error;
    ExitCode exit_code = kOk;
};

/// The failure among several inputs that decides the exit code; null if all went well. It is the first, but a
/// file that cannot be read comes before one that fails a check.
template <class Found>
const Failure* decisive_failure(const std::vector<Found>& inputs) {
    const Failure* decisive = nullptr;
    for (const Found& input : inputs) {
        if (!input.failure) continue;
        const bool only_check_failed = decisive && decisive->exit_code == kCheckFailed;
        if (!decisive || (only_check_failed && input.failure->exit_code != kCheckFailed))
            decisive = &*input.failure;
    }
    return decisive;
}

/// What `marrow info` found in one input.
struct Finding {
    std::filesystem::path input;
    std::optional<ScanReport> report;     ///< none: a failure came before
    std::optional<SampleReport> samples;  ///< of the series that would be read
    std::optional<Failure> failure;
};

/// What `marrow devices` found.
struct DeviceList {
    std::vector<gpu::Device> usable;
    std::vector<gpu::UnusableDevice> unusable;
    std::optional<std::size_t> automatic;  ///< the number of the one that --device auto uses; none: the CPU
    std::string why_none;                  ///< of either kind; empty: there are some
};

/// What `marrow check` found in one object of a file.
struct CheckedObject {
    std::string name;
    MeshCheck found;

    /// Only a closed mesh whose triangles all face one way encloses a volume.
    bool has_volume() const {
        return found.is_closed() && found.measures.nonmanifold_edges == 0 && found.misoriented_edges == 0;
    }
};

/// What `marrow check` found in one file.
struct CheckedFile {
    std::filesystem::path file;
    Space space = Space::none;
    std::vector<CheckedObject> objects;   ///< at least one, if the file could be read
    std::vector<MeshCrossing> crossings;  ///< of the objects
    std::optional<Failure> failure;       ///< why there are no objects, or what is wrong with them

    /// Objects may pass through each other: slicers take several objects as such.
    bool is_sound() const {
        return std::all_of(objects.begin(), objects.end(),
                           [](const CheckedObject& object) { return object.found.is_sound(); });
    }
    bool has_thin_walls() const {
        return std::any_of(objects.begin(), objects.end(),
                           [](const CheckedObject& object) { return object.found.thin_triangles > 0; });
    }
};

/// One level of detail of a terrain.
struct TerrainLevel {
    TerrainInfo info;
    Mesh mesh;
    std::filesystem::path output;  ///< empty: not written
    MeshMeasures measures = {};    ///< of the mesh, if it was measured
};

/// All that `marrow terrain` made.
struct TerrainResults {
    std::vector<TerrainLevel> levels;
    double exaggerate = 1;
    double extract_seconds = 0, write_seconds = 0, total_seconds = 0;
};

}  // namespace marrow::apps
