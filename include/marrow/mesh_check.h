/// Whether a mesh is fit to be printed and measured.
#pragma once

#include <cstdint>
#include <optional>

#include <marrow/export.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

struct CheckOptions {
    double min_wall = 0;  ///< mm; look for walls thinner than this; 0: do not
    Progress progress = {};
};

/// What check_mesh finds. Lengths are in the mesh's unit (mm). A triangle that names a point twice has no place
/// in a surface: it counts as degenerate and nowhere else.
struct MeshCheck {
    MeshMeasures measures;
    std::int64_t misoriented_edges = 0;     ///< that two triangles run in the same direction
    std::int64_t nonmanifold_points = 0;    ///< whose triangles hang together only at the point itself
    std::int64_t unused_points = 0;         ///< without a triangle
    std::int64_t degenerate_triangles = 0;  ///< without area, or with a point named twice
    std::int64_t cavities = 0;              ///< closed shells that face inward
    /// Handles, of all shells together; nothing where the mesh is not closed, manifold and oriented.
    std::optional<std::int64_t> genus;
    /// Pairs of triangles at which the surface passes through itself, decided exactly for the coordinates as they are: those
    /// whose insides meet along a line, and those that meet along an edge of one or both where the surface goes on, behind
    /// the edge, on the other side. Touching is no passing: in a point, along an edge with the rest on one side, or in a
    /// common plane, as parts do that stand on each other. Neighbours that share an edge never count, those that share a
    /// corner only where their insides meet.
    std::int64_t self_intersections = 0;
    /// Triangles whose middle is nearer than min_wall to where a ray inwards leaves the object again, their
    /// area, and the least of those distances; 0 where there are none.
    std::int64_t thin_triangles = 0;
    double thin_area = 0;
    double thinnest_wall = 0;

    bool is_closed() const { return measures.triangles > 0 && measures.boundary_edges == 0; }
    /// Along edges and at points.
    bool is_manifold() const {
        return measures.nonmanifold_edges == misoriented_edges && nonmanifold_points == 0;
    }
    /// Neighbours agree, and the whole faces outward.
    bool is_oriented() const { return misoriented_edges == 0 && (!is_closed() || measures.volume > 0); }
    /// Nothing that a slicer would have to repair, and no wall too thin.
    bool is_sound() const {
        return is_closed() && is_manifold() && is_oriented() && self_intersections == 0 &&
               degenerate_triangles == 0 && thin_triangles == 0;
    }
};

/// Checks a mesh. \throw InputError where a triangle names a point that is not there or a coordinate is not
/// finite, a min_wall that is negative or NaN; LimitError 2^32 triangles; Cancelled.
MARROW_EXPORT MeshCheck check_mesh(const Mesh& mesh, const CheckOptions& options = {});

}  // namespace marrow
