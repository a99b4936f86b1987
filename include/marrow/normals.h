/// Normals that agree with the triangles around their points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/streaming.h>

namespace marrow {

/// Replaces the normals that point against their faces, and returns how many. A normal does so if it has no
/// positive product with the mean of the unit normals of the faces around its point, each counted once or
/// weighted by its area. The replacement is halfway between these two means.
///
/// The normals of extract_isosurface() are gradients of the samples, which in one of a few thousand points of
/// a thin wall disagree with the triangles. Whoever shades a surface by its normals sees these
/// points as dark specks. The result does not depend on the number of threads (0: all). A mesh without
/// normals stays as it is. \pre indices are in range
MARROW_EXPORT std::size_t turn_normals_outward(Mesh& mesh, int threads = 0);

/// Finds the same normals in a surface that comes in parts.
class MARROW_EXPORT OutwardNormals {
  public:
    struct Replacement {
        std::uint64_t point = 0;  ///< its number in the whole surface
        Vec3f normal{};
    };

    /// The most that add() allocates and keeps, for each point of the part.
    static constexpr std::size_t kBytesPerPoint = 140;

    /// Returns what to replace among the points of this part that the next one does not have. Expects the
    /// parts of extract_isosurface_in_slabs(), in order, with normals.
    std::vector<Replacement> add(const SurfacePart& part, int threads = 0);

  private:
    // The faces around a point that were seen so far.
    struct Faces {
        Vec3d units{}, areas{};  // sums of unit normals, and of normals as long as the area
        bool face_against = false;
    };

    std::vector<Faces> shared_;  // of the first points of the next part
};

}  // namespace marrow
