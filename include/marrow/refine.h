/// What is done to a mesh before it is written.
#pragma once

#include <marrow/mesh.h>

namespace marrow {

/// The connected piece of a mesh with the most triangles; the first of equals. Points, normals and triangles
/// keep their order. Of a hollow object this is the outer shell alone: cavities are pieces of their own. \pre
/// triangles name points that are there
Mesh largest_component(const Mesh& mesh);

}  // namespace marrow
