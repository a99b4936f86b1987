/// An axis-aligned bounding box of float coordinates.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>

#include <marrow/mesh.h>
#include <marrow/vector.h>

namespace marrow::internal {

/// Empty at first: `lower` is above `upper`.
struct Bounds {
    static constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Vec3f lower{kInfinity, kInfinity, kInfinity};
    Vec3f upper{-kInfinity, -kInfinity, -kInfinity};

    void include(const Vec3f& p) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    /// Other bounds, which may be empty.
    void include(const Bounds& other) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], other.lower[axis]);
            upper[axis] = std::max(upper[axis], other.upper[axis]);
        }
    }
    /// The largest extent along an axis. Infinite if it does not fit into a float.
    float width() const {
        float widest = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) widest = std::max(widest, upper[axis] - lower[axis]);
        return widest;
    }
    bool operator==(const Bounds&) const = default;
    /// Whether other bounds overlap or touch these. Without branches, as the answer is unpredictable.
    bool overlaps(const Bounds& other) const {
        bool apart = false;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            apart |= lower[axis] > other.upper[axis];
            apart |= other.lower[axis] > upper[axis];
        }
        return !apart;
    }
};

/// The bounds of points, without coordinates that are NaN. Runs on all threads.
Bounds bounds_of(std::span<const Vec3f> points);

/// The same for the corners of the triangles of a mesh, without its other points.
/// \pre indices are in range
Bounds bounds_of_triangles(const MeshView& mesh);

}  // namespace marrow::internal
