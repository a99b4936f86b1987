/// Whether coordinates are numbers.
#pragma once

#include <cmath>
#include <span>

#include <marrow/vector.h>

namespace marrow::internal {

/// Whether no coordinate is NaN or infinite.
inline bool all_finite(std::span<const Vec3f> points) {
    bool all = true;  // without a branch, so that compilers make vectors
    for (const Vec3f& p : points) all &= std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
    return all;
}

}  // namespace marrow::internal
