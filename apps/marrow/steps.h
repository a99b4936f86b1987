/// The steps that change a scan before extraction and a surface after it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/progress.h>
#include <marrow/vector.h>
#include <marrow/volume.h>
#include <marrow/volume_filters.h>

#include "results.h"
#include "shared/arguments.h"

namespace marrow::apps {

/// The part of a scan to keep.
struct CropBox {
    Box box;  ///< both ends included
    bool in_samples = false;
    Space space = Space::LPS;  ///< of the box, if it is in mm
};

/// The steps before extraction, in this order.
struct FilterSteps {
    std::optional<CropBox> crop;
    int median = 0;        ///< radius in samples; 0: none
    double blur = 0;       ///< mm; 0: none
    double isotropic = 0;  ///< mm; 0: none

    bool any() const { return crop || median > 0 || blur > 0 || isotropic > 0; }
};

/// The steps after extraction: components, smooth, reduce, in this order.
struct SurfaceSteps {
    bool largest = false;
    std::int64_t components = 0;  ///< 0: all
    double min_volume = 0;        ///< mm^3
    bool no_cavities = false;
    int smooth = 0;  ///< iterations; 0: none
    /// How far smoothing may move a point, mm; 0: half a sample along each axis.
    std::optional<double> smooth_bound;
    std::optional<double> keep;  ///< of the triangles
    std::optional<std::int64_t> triangles;
    std::optional<double> max_error;  ///< mm

    bool choose_components() const { return largest || components > 0 || min_volume > 0 || no_cavities; }
    bool reduce() const { return keep || triangles || max_error; }
    bool any() const { return choose_components() || smooth > 0 || reduce(); }
};

/// `axes` says along which ones a box in mm lies: "the LPS axes".
void add_filter_options(Arguments& arguments, FilterSteps& steps, const std::string& axes);
void add_surface_options(Arguments& arguments, SurfaceSteps& steps);

/// \throw UsageError steps that contradict each other
void check_steps(const SurfaceSteps& steps);

/// The bounding box of the samples, LPS mm.
Box bounds(const Geometry& geometry);

/// Receives a scan.
using Inspect = std::function<void(const Volume&)>;

/// Does the steps before extraction. `before_mixing` receives the scan before values are mixed with those
/// around them: then padding is no longer told from other samples. \throw UsageError a crop box outside the
/// scan; others as in volume_filters.h
void filter_scan(Volume& scan, const FilterSteps& steps, int threads, const Progress& progress,
                 const Inspect& before_mixing = {});

/// Does the steps after extraction. `index_to_physical` is that of the volume that the surface was extracted
/// from. The reports have all measures, and not only the size, if these are wanted.
/// \throw as in components.h, smooth.h and simplify.h
std::vector<StepReport> refine_surface(Mesh& mesh, const SurfaceSteps& steps, const Mat3d& index_to_physical,
                                       bool all_measures, int threads, const Progress& progress);

}  // namespace marrow::apps
