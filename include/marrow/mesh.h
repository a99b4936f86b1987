/// Triangle meshes.
#pragma once

#include <array>
#include <cstdint>

#include <marrow/buffer.h>
#include <marrow/vector.h>

namespace marrow {

using Triangle = std::array<std::uint32_t, 3>;

/// A triangle mesh with shared points.
/// Points are millimetres in the patient space of the volume (LPS). Triangles are indices into `points`,
/// counter-clockwise seen from outside. `normals` has one unit vector a point, pointing outside, or is empty.
struct Mesh {
    Buffer<Vec3f> points;
    Buffer<Vec3f> normals;
    Buffer<Triangle> triangles;
};

}  // namespace marrow
