/// Keeping some of the connected pieces of a mesh.
#pragma once

#include <cstdint>

#include <marrow/export.h>
#include <marrow/mesh.h>

namespace marrow {

/// The connected piece of a mesh with the most triangles; the first of equals. Points, normals and triangles
/// keep their order. Of a hollow object this is the outer shell alone: cavities are pieces of their own. \pre
/// triangles name points that are there
MARROW_EXPORT Mesh largest_component(const Mesh& mesh);

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
MARROW_EXPORT Mesh keep_components(const Mesh& mesh, const ComponentOptions& options);

}  // namespace marrow
