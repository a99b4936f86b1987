/// Isosurfaces by marching cubes with histogram pyramids.
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
    bool normals = true;  ///< compute a unit normal for each point, from the gradient
    bool closed = false;  ///< close the surface at the volume's border, as if outside samples surrounded it
    /// Merge points near a sample, which gives fewer points and no slivers. No point moves further than this
    /// fraction of an edge, as explained below. 0 <= snap < 0.5; 0: do not merge
    double snap = 0;
    /// Give the surface exactly the topology of the trilinear interpolant, instead of separating inside
    /// corners in every ambiguous face. It does not go with `snap`
    bool topology = false;
    int threads = 0;         ///< threads to use; 0: all
    Progress progress = {};  ///< called during the extraction
};

/// What an extraction found, and the memory and time it took.
struct IsosurfaceStats {
    std::int64_t non_finite_samples = 0;  ///< NaN and infinite samples; they count as outside
    std::int64_t scratch_bytes = 0;       ///< memory in addition to the volume and the mesh
    double classify_seconds = 0;
    double count_seconds = 0;
    double emit_seconds = 0;  ///< points, normals and triangles, with `snap` also merging
};

/// Extracts the surface where the trilinear interpolant crosses `isovalue`.
///
/// A sample is inside if it is finite and >= isovalue. Each grid edge with exactly one end inside has one
/// point, which the triangles around it share. Where a face of a cell is ambiguous, its inside corners are
/// separated, in the same way from both sides, so the surface has no holes. Without `closed` it is open at
/// the volume's border. Points and triangles are ordered by the row (z, y) where their edge begins or their
/// cell is; in a row, triangles by x, and points by the axis of the edge and then by x. Their order and every
/// bit of them are the same for any number of threads and any processor.
///
/// With `topology`, the samples decide whether inside corners are joined across an ambiguous face, by the
/// asymptotic decider (Nielson and Hamann 1991), and within a cell by a tunnel, by Cayley's hyperdeterminant.
/// The decisions are exact for sample - isovalue rounded to double, and in ties they are those of an isovalue
/// that is lower by an infinitely small amount. So the surface has the components, holes and handles of the
/// trilinear interpolant. It is a manifold as well: some cells get one point or six points inside. Where a
/// sample is not finite, faces stay separated.
///
/// With `snap`, if an edge crosses the surface within that fraction of a sample, up to three of the points
/// on the sample's edges, on different axes, merge into one point between them. The others, and all of them
/// if the surface would not stay valid, move to that distance instead. Within the grid, where each edge has
/// the length 1, no point moves by more than `snap`: in mm by at most `snap` times a cell's longest edge, or
/// in a sheared grid sqrt(3) times as much. After SnapMC, Raman and Wenger 2008.
///
/// Marching cubes after Lorensen and Cline 1987; histogram pyramids after Ziegler et al. 2006 and Dyken et
/// al. 2008. `stats` may be null. \throw InputError a null view, bad geometry, an isovalue that is NaN or
/// infinite, or a bad snap; GeometryError with `snap`, float32 rounds coordinates so much that the surface
/// passes through itself; LimitError more than 2^32 - 1 points, or not enough memory; Cancelled
MARROW_EXPORT Mesh extract_isosurface(const VolumeView& volume, double isovalue,
                                      const IsosurfaceOptions& options = {},
                                      IsosurfaceStats* stats = nullptr);

/// Extracts many surfaces from one volume, as for a slider.
///
/// It keeps its buffers and remembers the range of values in each block of samples, so the next isovalue
/// reads only the blocks whose bits can change. The mesh is byte for byte that of extract_isosurface. Two
/// threads must not use one extractor at the same time.
class MARROW_EXPORT IsosurfaceExtractor {
  public:
    /// Borrows the volume's samples, which must outlive the extractor and not change. \throw InputError as
    /// extract_isosurface; LimitError not enough memory
    explicit IsosurfaceExtractor(const VolumeView& volume, const IsosurfaceOptions& options = {});
    ~IsosurfaceExtractor();
    IsosurfaceExtractor(IsosurfaceExtractor&&) noexcept;
    IsosurfaceExtractor& operator=(IsosurfaceExtractor&&) noexcept;

    /// Replaces `mesh` by the surface at `isovalue`, and reuses its memory. With `level` from 1 to 30 it is a
    /// preview from every 2^level-th sample along each axis, at their true positions; these samples are
    /// copied on the first use of a level. After an exception the extractor can be used as before, and the
    /// content of the mesh has no meaning. \throw as extract_isosurface
    void extract(double isovalue, Mesh& mesh, int level = 0, IsosurfaceStats* stats = nullptr);

    /// The same surface in a mesh that the extractor owns. It is valid until the next call with this level.
    const Mesh& extract(double isovalue, int level = 0, IsosurfaceStats* stats = nullptr);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The same surface, without `snap` and `topology`, by the traditional marching cubes, which visits every
/// cell and gives every triangle three points of its own, without normals. It is slow, and uses one thread:
/// it is here to compare with (Visutsak 2020) and to test against. \throw InputError as extract_isosurface
MARROW_EXPORT Mesh extract_isosurface_classic(const VolumeView& volume, double isovalue, bool closed = false);

}  // namespace marrow
