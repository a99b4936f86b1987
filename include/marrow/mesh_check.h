/// Checks whether a mesh is fit to be printed and measured.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <marrow/export.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

struct CheckOptions {
    std::optional<double> min_wall = {};  ///< mm; find walls that are thinner; not set: do not look for them
    int threads = 0;                      ///< 0: all
    Progress progress = {};
};

/// The result of check_mesh(). Lengths are in the unit of the mesh (mm).
/// A triangle with two equal indices counts only as degenerate. All other numbers ignore it.
struct MeshCheck {
    MeshMeasures measures;
    std::int64_t misoriented_edges = 0;     ///< edges whose two triangles run in the same direction
    std::int64_t nonmanifold_points = 0;    ///< points whose triangles form several fans
    std::int64_t unused_points = 0;         ///< points without a triangle
    std::int64_t degenerate_triangles = 0;  ///< triangles without area or with two equal indices
    std::int64_t cavities = 0;              ///< closed components that face inward
    /// Cavities that are inside of no other component, so that they are inside out. Counted if the mesh is
    /// closed.
    std::int64_t inverted_components = 0;
    /// The number of handles of all components. It is set if the mesh is closed and manifold and has no
    /// misoriented edges.
    std::optional<std::int64_t> genus;
    /// Pairs of triangles at which the surface passes through itself. The decision is exact for the given
    /// coordinates. A pair counts if the interiors of the triangles intersect along a line. It also counts if
    /// they intersect along an edge of one or both, and the surface continues on the other side of that edge.
    ///
    /// Triangles that only touch do not count: in a point, along an edge with the surface on one side, or in
    /// a common plane. Triangles that share an edge never count. Triangles that share one corner count only
    /// if their interiors intersect.
    std::int64_t self_intersections = 0;
    /// Triangles with a thin wall: a ray from the centre of the triangle into the object leaves the object
    /// after less than `min_wall`.
    std::int64_t thin_triangles = 0;
    double thin_area = 0;                 ///< mm^2; the area of these triangles
    std::optional<double> thinnest_wall;  ///< mm; the shortest of these rays; not set without thin triangles

    bool is_closed() const { return measures.triangles > 0 && measures.boundary_edges == 0; }
    /// Whether edges and points are manifold. Misoriented edges are allowed.
    bool is_manifold() const {
        return measures.nonmanifold_edges == misoriented_edges && nonmanifold_points == 0;
    }
    /// Whether neighbouring triangles agree in orientation, and the components of a closed mesh face outward,
    /// except for cavities inside of others.
    bool is_oriented() const {
        return misoriented_edges == 0 && (!is_closed() || (measures.volume > 0 && inverted_components == 0));
    }
    /// Whether a slicer has nothing to repair. A sound mesh may have thin walls:
    /// they are a matter of the printer.
    bool is_sound() const {
        return is_closed() && is_manifold() && is_oriented() && self_intersections == 0 &&
               degenerate_triangles == 0;
    }
};

/// Checks a mesh. The result is the same for any number of threads.
///
/// \throw InputError if a triangle has an index out of range, if a coordinate is not finite, or if `min_wall`
/// is negative or NaN
/// \throw LimitError if the mesh has 2^32 triangles or more
/// \throw Cancelled if `progress` returns false
MARROW_EXPORT MeshCheck check_mesh(MeshView mesh, const CheckOptions& options = {});

/// Two meshes that pass through each other.
struct MeshCrossing {
    std::size_t first = 0, second = 0;  ///< their indices, the lower one first
    std::int64_t pairs = 0;             ///< of triangles, counted as MeshCheck::self_intersections
};

/// Finds the meshes that pass through each other, ordered by their indices. Those that touch, such as the
/// surfaces of neighbouring labels, do not. `options.min_wall` changes nothing. \throw as check_mesh
MARROW_EXPORT std::vector<MeshCrossing> find_crossings(std::span<const MeshView> meshes,
                                                       const CheckOptions& options = {});

}  // namespace marrow
