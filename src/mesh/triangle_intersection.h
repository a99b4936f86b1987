/// Whether triangles pass through each other, decided exactly for the coordinates that they have.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <marrow/volume.h>

namespace marrow::internal {

/// On which side of the plane through a, b, c the place d lies: the sign of the volume they span, 0 in the plane. Exact where
/// the coordinates are those of floats.
int side_of(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// The part of a triangle that the plane of another one cuts off: the corner `alone` lies on one side of it, `beyond` on the
/// other; kNone: both other corners are in the plane, and so is the edge between them.
struct Cut {
    static constexpr std::size_t kNone = 3;
    std::size_t alone = kNone, beyond = kNone;

    bool along_edge() const { return beyond == kNone; }
};

/// How two triangles meet that share a stretch of line, more than a point, and not a plane.
struct Meeting {
    Cut s, t;

    /// Whether the inside of one meets the inside of the other: no neighbours do, and nothing that only touches.
    bool of_insides() const { return !s.along_edge() && !t.along_edge(); }
};

/// Of triangles with these corners; nothing where they do not meet so.
std::optional<Meeting> meet(const std::array<Vec3d, 3>& s, const std::array<Vec3d, 3>& t);

/// Whether two sheets, bent along one line through p and q, go through each other there: one ends in the places a[0] and a[1]
/// on its sides of the line, the other in b[0] and b[1]. Not so where any two of them lie in one direction from the line.
bool sheets_cross(const Vec3d& p, const Vec3d& q, const std::array<Vec3d, 2>& a,
                  const std::array<Vec3d, 2>& b);

}  // namespace marrow::internal
