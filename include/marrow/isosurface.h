/// Isosurfaces by marching cubes over a histogram pyramid.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

struct IsosurfaceOptions {
    bool normals = true;     ///< a unit normal for each point, from the gradient
    bool closed = false;     ///< close the surface at the volume's border, as if surrounded by outside
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while extracting
};

/// What an extraction found and took.
struct IsosurfaceStats {
    std::int64_t non_finite_samples = 0;  ///< NaN and infinite samples; they count as outside
    std::int64_t scratch_bytes = 0;       ///< memory beside volume and mesh
    double classify_seconds = 0;
    double count_seconds = 0;
    double emit_seconds = 0;
};

/// Extracts the surface where the trilinear interpolant crosses `isovalue`.
///
/// A sample is inside if it is finite and >= isovalue. Every grid edge with one end inside has one point,
/// shared by the triangles around it; where the face between inside corners is ambiguous they are separated,
/// the same way from both sides, so that the surface has no holes. Without `closed` it is open where it meets
/// the volume's border. The order of points and triangles, and every bit of them, does not depend on
/// `threads` or the processor.
///
/// Marching cubes after Lorensen and Cline 1987; histogram pyramid after Ziegler et al. 2006 and Dyken et al.
/// 2008. `stats`, where given, receives what was found. \throw InputError a NaN or infinite isovalue or bad
/// geometry; LimitError more than 2^32 - 1 points or triangles' memory not to be had; Cancelled.
Mesh extract_isosurface(const VolumeView& volume, double isovalue, const IsosurfaceOptions& options = {},
                        IsosurfaceStats* stats = nullptr);

/// The same surface by traditional table-driven marching cubes: every cell is visited and every triangle has
/// its own three points (no normals). The comparison of Visutsak 2020 and the oracle of the tests; slow.
Mesh extract_isosurface_classic(const VolumeView& volume, double isovalue, bool closed = false);

}  // namespace marrow
