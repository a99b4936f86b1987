/// Decides whether triangles intersect, exactly for the given coordinates.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <marrow/vector.h>

#include "triangle_corners.h"

namespace marrow::internal {

/// On which side of the plane through a, b, c the point d is: the sign of the volume that they span, 0 in the
/// plane. Exact if the coordinates are float values.
int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// How a plane cuts a triangle: the corner `apex` is alone on its side of the plane, and the corner
/// `opposite` is on the other side. If `opposite` is kNone, the edge opposite to the apex is in the plane.
struct PlaneCut {
    static constexpr std::size_t kNone = 3;
    std::size_t apex = kNone, opposite = kNone;

    bool is_along_edge() const { return opposite == kNone; }
};

/// Two triangles that intersect along a line segment and have different planes.
struct TriangleIntersection {
    PlaneCut s, t;  ///< how the plane of the other triangle cuts each

    /// Whether the segment is in the interior of both triangles.
    bool is_of_interiors() const { return !s.is_along_edge() && !t.is_along_edge(); }
};

/// Intersects two triangles. Returns nothing if they share no line segment or have a common plane.
std::optional<TriangleIntersection> intersect(const TriangleCorners& s, const TriangleCorners& t);

/// Whether two sheets that are folded along the line through p and q cross each other there. One sheet has
/// the points a[0] and a[1] on its two sides, the other sheet b[0] and b[1]. False if any two of these are in
/// the same direction from the line.
bool sheets_cross(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 2>& a,
                  const std::array<Vec3d, 2>& b);

}  // namespace marrow::internal
