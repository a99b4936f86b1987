/// Reducing the number of triangles of a mesh.
#pragma once

#include <cstdint>
#include <limits>

#include <marrow/export.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

struct SimplifyOptions {
    std::int64_t triangles = 0;  ///< stop where no more than so many are left
    /// mm; how far the two surfaces may lie apart, as mesh_distance measures it. With 0 triangles this alone
    /// says where to stop.
    double max_error = std::numeric_limits<double>::infinity();
    Progress progress = {};
};

struct SimplifyStats {
    MeshDistance deviation;   ///< of the result from the mesh, as mesh_distance measures it
    bool backed_off = false;  ///< no result kept the error or the topology: the mesh is as it was
};

/// Takes triangles off a mesh where they matter least, by collapsing edges in the order of their quadric error.
/// After Garland and Heckbert 1997.
///
/// Topology stays: a closed, manifold mesh gives a closed, manifold one with the same pieces, cavities and
/// handles; so no piece vanishes, and a piece of few triangles may keep the result above `triangles`. Points on
/// open or non-manifold edges stay. With max_error the result is measured, and made again with less freedom
/// where it lies too far away, until it keeps the error everywhere. Normals, where there are any, become those
/// of the triangles. Without max_error and `stats` nothing is measured, which is faster. The same bits for any
/// number of threads. \throw InputError negative triangles, a max_error that is not positive, triangles that name
/// no point; LimitError 2^30 triangles; Cancelled
MARROW_EXPORT Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats = nullptr);

}  // namespace marrow
