/// Keeps some connected components of a mesh and drops the others.
#pragma once

#include <cstdint>
#include <optional>

#include <marrow/export.h>
#include <marrow/mesh.h>

namespace marrow {

/// Which components keep_components keeps.
struct ComponentOptions {
    /// Keep this many components: those with the most triangles, and the first of equals. Cavities do not
    /// count. Not set: all.
    std::optional<std::int64_t> count = {};
    double min_volume = 0;  ///< mm^3; drop closed components and cavities that enclose less
    bool cavities =
        true;         ///< keep cavities; otherwise they are filled, and closed components in them dropped
    int threads = 0;  ///< 0: all
};

/// Returns the chosen components of a mesh. Points, normals and triangles keep their order. Points that no
/// triangle uses are dropped.
///
/// A component is a set of triangles that are connected through shared points. A closed component that faces
/// inward is a cavity. It belongs to the smallest closed component around it, or to the open one that a ray
/// from it leaves first, and `count` drops it together with that one. If there is none, it counts as any
/// other component. An open component encloses no volume, so `min_volume` does not apply to it.
/// `{.count = 1, .cavities = false}` returns the largest component alone.
///
/// Takes nearly linear time. \throw InputError if `count` is below 1, if `min_volume` is negative or NaN, if
/// a triangle has an index out of range, or if a coordinate is not finite
/// \throw LimitError if the mesh has 2^32 triangles or more
MARROW_EXPORT Mesh keep_components(MeshView mesh, const ComponentOptions& options);

}  // namespace marrow
