/// Measures how far one mesh is from another, in one direction.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// The distances of a mesh to another mesh.
struct Distances {
    struct SurfaceSample {
        Vec3d position;
        std::uint32_t triangle;  ///< the triangle that contains the position
        double distance;
    };
    std::vector<SurfaceSample> samples;  ///< spread over the area
    std::vector<double> points;          ///< the distance of each point of the mesh

    double max() const;
    double mean() const;  ///< over the area
};

/// Which distances to compute.
struct DistanceSearch {
    std::int64_t samples = DistanceOptions{}.samples;  ///< above 0
    /// The distances of points are bounds: a point that is not further than `enough`, or than another point,
    /// may get a larger distance than it has. That distance exceeds neither of the two. So the maximum is
    /// right, and so is which points are further than `enough`.
    double enough = std::numeric_limits<double>::infinity();
};

/// Measures from `from` to the mesh of the tree `to`. Reports progress from `begin` to `end`.
/// \pre both meshes have triangles, whose indices are in range; `from_tree` is the tree of `from`
/// \throw Cancelled
Distances distances(const MeshView& from, const TriangleTree& from_tree, const TriangleTree& to,
                    const DistanceSearch& search, const Progress& progress = {}, double begin = 0,
                    double end = 1);

/// Combines the two directions.
MeshDistance symmetric(const Distances& there, const Distances& back);

}  // namespace marrow::internal
