/// Triangles in an order in which those that follow each other lie near each other.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// A triangle of a mesh, and which cell its middle is in of 1024^3 in the mesh's box: three bits, one of each axis, part the box
/// into eight, the next three these, and so on.
struct OnCurve {
    std::uint32_t key, triangle;
};

/// The triangles by key, after Morton 1966; those of a cell as they come in the mesh. \pre fewer than 2^32
std::vector<OnCurve> along_morton_curve(const Mesh& mesh);

}  // namespace marrow::internal
