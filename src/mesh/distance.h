/// How far places of one mesh are from another mesh.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// The distances of a mesh from another: of places spread over its area, and of its points.
struct Distances {
    struct Place {
        Vec3d place;
        std::uint32_t triangle;  ///< that the place is in
        double distance;
    };
    std::vector<Place> places;
    std::vector<double> points;

    double max() const;
    double mean() const;  ///< over the area
};

/// The trees are those of the two meshes. Of the points, a distance that is no more than `enough`, or than another
/// one, may come out larger than it is, though no larger than these: the largest, and which are above `enough`, are right.
/// \pre both meshes have triangles, which name points that are there; samples > 0
Distances distances(const Mesh& from, const TriangleTree& from_tree, const TriangleTree& to,
                    std::int64_t samples, double enough = std::numeric_limits<double>::infinity());

/// Of both directions' distances.
MeshDistance symmetric(const Distances& there, const Distances& back);

/// How many places mesh_distance takes by default.
inline constexpr std::int64_t kDistanceSamples = 200'000;

}  // namespace marrow::internal
