/// The direction in which a field falls off most steeply on both sides.
#pragma once

#include <cmath>
#include <optional>

#include <marrow/vector.h>

namespace marrow::internal {

/// The direction across a ridge, and whether the field is nearly constant along it.
struct RidgeNormal {
    Vec3d normal;  ///< unit vector
    bool is_sheet;
};

/// The direction in which a field with these second derivatives falls off most steeply on both sides: the
/// eigenvector of the lowest eigenvalue. None if there is no such direction. The ridge is a sheet if the
/// largest eigenvalue is at most half as large as the lowest one, which is negative: else the field rises
/// along the ridge, as it does between two bodies that nearly touch and beside a sharp edge.
inline std::optional<RidgeNormal> ridge_normal(Mat3d h) {
    // Jacobi's method: rotations that make one off-diagonal element 0 after the other.
    Mat3d vectors{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
    constexpr int kSweeps = 3;  // converges quadratically: enough for the direction
    for (int rotation = 0; rotation < 3 * kSweeps; ++rotation) {
        const std::size_t p = rotation % 3 == 2 ? 1 : 0, q = rotation % 3 == 0 ? 1 : 2;
        if (h[p][q] == 0) continue;
        const double theta = (h[q][q] - h[p][p]) / (2 * h[p][q]);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < 3; ++k) {
            const double a = h[k][p], b = h[k][q];
            h[k][p] = c * a - s * b;
            h[k][q] = s * a + c * b;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            const double a = h[p][k], b = h[q][k];
            h[p][k] = c * a - s * b;
            h[q][k] = s * a + c * b;
            const double u = vectors[k][p], v = vectors[k][q];
            vectors[k][p] = c * u - s * v;
            vectors[k][q] = s * u + c * v;
        }
    }
    std::size_t lowest = 0, highest = 0;
    for (std::size_t a = 1; a < 3; ++a) {
        if (h[a][a] < h[lowest][lowest]) lowest = a;
        if (h[a][a] >= h[highest][highest]) highest = a;
    }
    if (!(h[lowest][lowest] < 0)) return {};
    return RidgeNormal{column(vectors, lowest), h[highest][highest] <= -0.5 * h[lowest][lowest]};
}

}  // namespace marrow::internal
