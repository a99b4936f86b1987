/// Reduces the number of triangles of a mesh.
#pragma once

#include <cstdint>
#include <optional>

#include <marrow/export.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

/// When to stop. With both limits, simplify stops at the first that it reaches. With neither, it goes on
/// until hardly any edge can be collapsed.
struct SimplifyOptions {
    std::optional<std::int64_t> triangles = {};  ///< stop when this many triangles or fewer are left
    std::optional<double> max_error = {};        ///< mm; the largest allowed MeshDistance::max
    int threads = 0;                             ///< 0: all
    Progress progress = {};
};

struct SimplifyStats {
    MeshDistance deviation;  ///< mesh_distance between the mesh and the result
    /// Collapses that were undone because the surface passed through itself or was too far from the mesh.
    std::int64_t undone_collapses = 0;
};

/// Reduces the triangles of a mesh by collapsing edges in the order of their quadric error.
/// After Garland and Heckbert 1997.
///
/// The topology does not change: a closed, manifold mesh stays closed and manifold, with the same components,
/// cavities and handles. No component vanishes, so the result may have more than `triangles` triangles. Nor
/// does the surface pass through itself where it did not before: MeshCheck::self_intersections stays 0.
/// Points on open or non-manifold edges stay. If the mesh has normals, they are computed again from the
/// triangles, unless it has few enough triangles already. The result has the same bits for any number of
/// threads.
///
/// With `max_error`, simplify measures the result, and undoes collapses where the error is too large, until
/// it is within the limit everywhere. Without `max_error` and `stats` it measures nothing, which is faster.
///
/// \throw InputError if `triangles` is negative, if `max_error` is not positive, if a triangle has an index
/// out of range, or if a coordinate is not finite
/// \throw LimitError if the mesh has 2^30 triangles or more
/// \throw Cancelled if `progress` returns false
MARROW_EXPORT Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats = nullptr);

}  // namespace marrow
