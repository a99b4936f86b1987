/// The triangle mesh that Marrow extracts, changes, measures and writes.
#pragma once

#include <array>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/vector.h>

namespace marrow {

/// The indices of a triangle's points, counter-clockwise as seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// A triangle mesh whose triangles share their points.
struct Mesh {
    Buffer<Vec3f> points;        ///< mm, in the patient space of the volume (LPS)
    Buffer<Vec3f> normals;       ///< one outward unit vector per point, or empty
    Buffer<Triangle> triangles;  ///< indices into `points`
};

}  // namespace marrow
