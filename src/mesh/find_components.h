/// Finds and measures the connected components of a mesh.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "mesh/connectivity/count_edges.h"
#include "mesh/connectivity/one_rings.h"

namespace marrow::internal {

/// Triangles that are connected through shared points.
struct Component {
    std::uint32_t first_triangle = 0;
    std::int64_t triangles = 0;
    double volume = 0;   ///< mm^3; negative if the component faces inward
    bool closed = true;  ///< every edge has two triangles that agree in orientation

    /// Only a closed component encloses a volume, so an open one is never a cavity.
    bool is_cavity() const { return closed && volume < 0; }
};

struct Components {
    std::vector<Component> all;           ///< in the order of their lowest points
    std::vector<std::uint32_t> of_point;  ///< an index into `all`; kNone for a point without a triangle
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    std::uint32_t of(const Triangle& t) const { return of_point[t[0]]; }
};

/// Takes nearly linear time, on all threads. The result has the same bits for any number of them. `rings` are
/// those of the mesh. \pre indices are in range
Components find_components(const MeshView& mesh, const OneRings& rings);

/// The same as measure(), given the components and the edges of the mesh.
MeshMeasures measure_components(const MeshView& mesh, const Components& components, const EdgeCounts& edges);

}  // namespace marrow::internal
