/// Isosurfaces by marching cubes over a histogram pyramid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

struct IsosurfaceOptions {
    bool normals = true;  ///< a unit normal for each point, from the gradient
    bool closed = false;  ///< close the surface at the volume's border, as if surrounded by outside
    /// Fewer points and no slivers, by joining points that lie round one sample; 0: off. No point moves
    /// further than this part of an edge. 0 <= snap < 0.5
    double snap = 0;
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called while extracting
};

/// What an extraction found and took.
struct IsosurfaceStats {
    std::int64_t non_finite_samples = 0;  ///< NaN and infinite samples; they count as outside
    std::int64_t scratch_bytes = 0;       ///< memory beside volume and mesh
    double classify_seconds = 0;
    double count_seconds = 0;
    double emit_seconds = 0;  ///< points, normals and triangles, and joining points where `snap` asks for it
};

/// Extracts the surface where the trilinear interpolant crosses `isovalue`.
///
/// A sample is inside if it is finite and >= isovalue. Every grid edge with one end inside has one point,
/// shared by the triangles around it; where the face between inside corners is ambiguous they are separated,
/// the same way from both sides, so that the surface has no holes. Without `closed` it is open where it meets
/// the volume's border. The order of points and triangles, and every bit of them, does not depend on
/// `threads` or the processor.
///
/// With `snap`, where the surface crosses an edge within that part of it from a sample, the points on the
/// sample's edges become one amid them, unless the surface would cease to be a manifold there; then they keep
/// that distance from the sample. The surface stays within `snap` of a cell's longest edge. After SnapMC,
/// Raman and Wenger 2008.
///
/// Marching cubes after Lorensen and Cline 1987; histogram pyramid after Ziegler et al. 2006 and Dyken et al.
/// 2008. `stats`, where given, receives what was found. \throw InputError a NaN or infinite isovalue, bad
/// geometry or snap; LimitError more than 2^32 - 1 points or triangles' memory not to be had; Cancelled.
MARROW_EXPORT Mesh extract_isosurface(const VolumeView& volume, double isovalue,
                                      const IsosurfaceOptions& options = {},
                                      IsosurfaceStats* stats = nullptr);

/// Extracts from one volume again and again, for sliders and sweeps.
///
/// It remembers what range of values lies in each block of samples, which does not depend on the isovalue,
/// and keeps its buffers: the next isovalue reads only the blocks that the surface leaves or enters. The mesh
/// is byte for byte the one that extract_isosurface makes. Not for use by two threads at once.
class MARROW_EXPORT IsosurfaceExtractor {
  public:
    /// Borrows the volume's samples, which must outlive it and not change. \throw InputError as
    /// extract_isosurface
    explicit IsosurfaceExtractor(const VolumeView& volume, const IsosurfaceOptions& options = {});
    ~IsosurfaceExtractor();
    IsosurfaceExtractor(IsosurfaceExtractor&&) noexcept;
    IsosurfaceExtractor& operator=(IsosurfaceExtractor&&) noexcept;

    /// The surface at `isovalue`, valid until the next call. With `level` > 0, a preview from every
    /// 2^level-th sample along each axis, at their true places; its samples are copied on first use. \throw
    /// as extract_isosurface; after Cancelled the extractor is as good as before. \pre level >= 0
    const Mesh& extract(double isovalue, int level = 0, IsosurfaceStats* stats = nullptr);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The same surface by traditional table-driven marching cubes: every cell is visited and every triangle has
/// its own three points (no normals). The comparison of Visutsak 2020 and the oracle of the tests; slow.
MARROW_EXPORT Mesh extract_isosurface_classic(const VolumeView& volume, double isovalue, bool closed = false);

}  // namespace marrow
