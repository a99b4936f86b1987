/// Smooths a mesh with little shrinking.
#pragma once

#include <cstdint>
#include <optional>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/vector.h>

namespace marrow {

struct SmoothOptions {
    /// The degree of the filter: a point depends on this many rings of neighbours. A higher degree cuts more
    /// sharply between the frequencies that it keeps and those that it removes.
    int iterations = 20;
    /// The filter keeps shapes whose spatial frequency k is lower than this; 0 < pass_band < 2. On an even
    /// mesh with edge length h, a wave of length L has k = (2 pi h / L)^2 / 4. So 0.1 keeps waves that are
    /// longer than about 10 edges.
    double pass_band = 0.1;
    /// Geometry::index_to_physical() of the volume that the mesh was extracted from. If it is set, each point
    /// moves at most half a sample along each index axis.
    std::optional<Mat3d> bound = {};
    /// mm; no point moves further, but for the rounding of coordinates; not set: no limit
    std::optional<double> max_move = {};
    int threads = 0;  ///< 0: all
    Progress progress = {};
};

struct SmoothStats {
    std::int64_t restored_components = 0;  ///< closed components that were left unsmoothed
    /// Points that moved less far than the filter would have them, because the surface would have passed
    /// through itself.
    std::int64_t held_back_points = 0;
    /// How far the points moved, in mm. The surface moved no further than its points.
    double moved_mean = 0, moved_max = 0;
};

/// Removes noise and steps from a mesh with a windowed sinc filter over its edges (Taubin, Zhang and Golub
/// 1996). Unlike averaging, this filter shrinks only parts that are a few samples thick.
///
/// Only points move, so the surface stays as closed and as manifold as it was. Where it would pass through
/// itself, points go back part of the way that they came: MeshCheck::self_intersections does not increase,
/// and 0 stays 0. Points on open or non-manifold edges do not move, nor do points that would move
/// to infinity. A closed component keeps its shape if its volume would change by more than half; this
/// happens to specks of a few samples. If the mesh has normals, they are computed again from the triangles,
/// unless `iterations` is 0. The result has the same bits for any number of threads.
///
/// \throw InputError if `iterations` or `max_move` is negative, if `pass_band` is outside its range, if
/// `bound` is singular, if a triangle has an index out of range, or if a coordinate is not finite
/// \throw LimitError if the mesh has 2^32 triangles or more
/// \throw Cancelled if `progress` returns false
MARROW_EXPORT Mesh smooth(const Mesh& mesh, const SmoothOptions& options = {}, SmoothStats* stats = nullptr);

}  // namespace marrow
