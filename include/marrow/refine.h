/// What is done to a mesh before it is written.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// The connected piece of a mesh with the most triangles; the first of equals. Points, normals and triangles
/// keep their order. Of a hollow object this is the outer shell alone: cavities are pieces of their own. \pre
/// triangles name points that are there
Mesh largest_component(const Mesh& mesh);

/// Which shells of a mesh to keep; see keep_components.
struct ComponentOptions {
    std::int64_t count = 0;  ///< so many pieces, those whose outer shells have the most triangles; 0: all
    double min_volume = 0;   ///< mm^3; shells that enclose less go, specks and small cavities alike
    bool cavities = true;    ///< keep the walls of hollows
};

/// The chosen pieces of a mesh; points, normals and triangles keep their order, and points without a triangle
/// go.
///
/// A shell is a set of triangles connected through shared points. A closed shell that encloses a negative
/// volume is a cavity: it goes with the smallest piece around it, and alone it never stays. Every other shell
/// is a piece. An open shell encloses no volume that could be compared, so min_volume and `cavities` leave it.
/// In near-linear time. \throw InputError a negative count or volume, NaN, or triangles that name no point
Mesh keep_components(const Mesh& mesh, const ComponentOptions& options);

struct SmoothOptions {
    /// The filter's degree: how many rings of neighbours take part. More make it sharper.
    int iterations = 20;
    /// What passes: the filter keeps shapes whose spatial frequency k is below, 0 < k < 2. On an even mesh of
    /// edge length h a wave of length L has k = (2 pi h / L)^2 / 4, so 0.1 keeps waves from about 10 edges on.
    double pass_band = 0.1;
    /// Geometry::index_to_physical() of the volume that the mesh was extracted from: each point then stays
    /// within half a sample of where it was along each index axis.
    std::optional<Mat3d> bound = {};
    Progress progress = {};
};

struct SmoothStats {
    std::int64_t restored_shells = 0;  ///< closed shells left unsmoothed, since they would have gone
};

/// Takes noise and steps off a mesh by a windowed sinc filter over its edges, which does not shrink it as
/// averaging does. After Taubin, Zhang and Golub 1996.
///
/// Points move and triangles stay, so that the surface is as closed and manifold as before. Points on open or
/// non-manifold edges stay where they are. A shell whose volume would change by more than half, a speck of a
/// few samples, keeps its shape. Normals, where there are any, become those of the triangles. The same bits
/// for any number of threads. \throw InputError negative iterations, a pass band outside its range, a singular
/// bound, triangles that name no point; Cancelled
Mesh smooth(const Mesh& mesh, const SmoothOptions& options = {}, SmoothStats* stats = nullptr);

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
Mesh simplify(const Mesh& mesh, const SimplifyOptions& options, SimplifyStats* stats = nullptr);

}  // namespace marrow
