/// From positions in space back to indices of samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <marrow/volume.h>

namespace marrow::python {

/// The mapping from positions to indices, for a volume whose index axes are parallel to axes of space: index
/// m of a position p is p[axis[m]] * scale[m] + offset[m].
struct IndexMapping {
    std::array<std::int64_t, 3> dims;
    std::array<std::size_t, 3> axis{};  ///< the axis of space along which index axis m runs
    std::array<double, 3> scale{}, offset{};

    explicit IndexMapping(const Geometry& geometry) : dims(geometry.dims) {
        for (std::size_t m = 0; m < 3; ++m) {
            for (std::size_t row = 1; row < 3; ++row)
                if (std::abs(geometry.direction[row][m]) > std::abs(geometry.direction[axis[m]][m]))
                    axis[m] = row;
            scale[m] = 1 / (geometry.direction[axis[m]][m] * geometry.spacing[m]);
            offset[m] = -geometry.origin[axis[m]] * scale[m];
        }
    }

    /// The lowest sample of the cell around a position.
    std::array<std::int64_t, 3> cell_of(const Vec3d& position) const {
        std::array<std::int64_t, 3> cell{};
        for (std::size_t m = 0; m < 3; ++m)
            cell[m] =
                std::clamp(static_cast<std::int64_t>(std::floor(position[axis[m]] * scale[m] + offset[m])),
                           std::int64_t{0}, dims[m] - 2);
        return cell;
    }
};

}  // namespace marrow::python
