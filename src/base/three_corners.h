/// Whether triangles have three corners.
#pragma once

#include <marrow/mesh.h>

namespace marrow::internal {

/// Whether the corners of a triangle are three different points.
inline bool has_three_corners(const Triangle& t) {
    return t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
}

}  // namespace marrow::internal
