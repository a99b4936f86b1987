/// Smoothing a mesh without shrinking it.
#pragma once

#include <cstdint>
#include <optional>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/vector.h>

namespace marrow {

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
MARROW_EXPORT Mesh smooth(const Mesh& mesh, const SmoothOptions& options = {}, SmoothStats* stats = nullptr);

}  // namespace marrow
