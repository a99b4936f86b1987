// What is done to a scan before, and to a surface after it is extracted.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <marrow/components.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/progress.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>
#include <marrow/volume.h>
#include <marrow/volume_filters.h>

namespace marrow {

/// The steps that are asked for. Their order is fixed: crop, median, blur, resampling; then, of each surface,
/// pieces, smoothing, reduction.
struct Steps {
    std::optional<Box> crop;
    bool crop_in_samples = false;
    bool crop_in_ras = false;  ///< was asked for in RAS; `crop` is in LPS
    int median = 0;            ///< radius in samples; 0: none
    double blur = 0;           ///< mm; 0: none
    double isotropic = 0;      ///< mm; 0: as it is

    bool largest = false;
    ComponentOptions components;
    int smooth = 0;  ///< iterations; 0: none
    bool smooth_bound = false;
    std::optional<double> keep;  ///< of the triangles
    std::optional<std::int64_t> triangles;
    std::optional<double> max_error;  ///< mm

    bool change_volume() const { return crop || median > 0 || blur > 0 || isotropic > 0; }
    bool choose_pieces() const {
        return largest || components.count || components.min_volume > 0 || !components.cavities;
    }
    bool reduce() const { return keep || triangles || max_error; }
    bool change_surface() const { return choose_pieces() || smooth > 0 || reduce(); }
};

/// What one step did to a surface.
struct StepReport {
    std::string name;  ///< "components", "smooth" or "reduce"
    MeshMeasures before, after;
    std::optional<MeshDistance> deviation;  ///< of the surface after from that before, where measured
    std::string note;                       ///< what the user must know; empty: nothing
};

/// Does the steps before extraction, in order. \throw as in filter.h
void filter_scan(Volume& scan, const Steps& steps, int threads, const Progress& progress);

/// Does the steps after extraction, in order. `index_to_physical` is that of the volume that the surface comes
/// from. \throw as in refine.h
std::vector<StepReport> refine_surface(Mesh& mesh, const Steps& steps, const Mat3d& index_to_physical,
                                       int threads, const Progress& progress);

}  // namespace marrow
