// Writes the points inside ambiguous cells, their normals, and their triangles.
#include <hwy/base.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "ambiguous_cells.h"
#include "core/volume/rows.h"
#include "corner_samples.h"
#include "inner_normals.h"
#include "inner_points.h"
#include "tunnel_triangles.h"

namespace marrow::internal {

namespace {

// The derivative of the samples at *p along an axis: central differences where the samples allow,
// else one-sided ones, as for the normals of points on edges. `before` and `after` are the steps
// to the samples beside it, or 0.
template <class T>
double slope(const T* p, std::int64_t before, std::int64_t after) {
    // Halved before the difference, so that it does not overflow.
    const double rise = static_cast<double>(p[after]) / 2 - static_cast<double>(p[-before]) / 2;
    return before != 0 && after != 0 ? rise : 2 * rise;
}

// The slopes of the cells of a row.
template <class T>
class RowSlopes {
  public:
    RowSlopes(const VolumeView& volume, std::int64_t y, std::int64_t z)
        : volume_(volume), y_(y), z_(z), stride_{1, volume.row_pitch(), volume.slice_pitch()} {
        find_neighbours(1, y);
        find_neighbours(2, z);
    }

    // Where a sample is not finite, those of the inside bits.
    CellSlopes of_cell(std::int64_t x, const CellValues& values) {
        CellSlopes cell;
        if (std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
            for (std::size_t v = 0; v < 8; ++v) cell.values[v] = values[v] >= 0 ? 1 : -1;
            return cell;
        }
        cell.values = well_scaled(values);
        cell.has_corners = true;
        find_neighbours(0, x);
        const T* const first = row_of<T>(volume_, y_, z_) + x;
        for (std::size_t v = 0; v < 8; ++v) {
            const T* p = first;
            for (std::size_t a = 0; a < 3; ++a) p += (v >> a & 1) != 0 ? stride_[a] : 0;
            for (std::size_t a = 0; a < 3; ++a)
                cell.corners[v][a] = slope(p, before_[a][v >> a & 1], after_[a][v >> a & 1]);
        }
        return cell;
    }

  private:
    void find_neighbours(std::size_t axis, std::int64_t place) {
        for (std::size_t side = 0; side < 2; ++side) {
            const std::int64_t i = place + static_cast<std::int64_t>(side);
            before_[axis][side] = i > -volume_.below[axis] ? stride_[axis] : 0;
            after_[axis][side] =
                i + 1 < volume_.geometry.dims[axis] + volume_.above[axis] ? stride_[axis] : 0;
        }
    }

    const VolumeView& volume_;
    const std::int64_t y_, z_;
    const std::array<std::int64_t, 3> stride_;
    // The steps from the samples at the two sides of the cell, by axis, or 0.
    std::array<std::array<std::int64_t, 2>, 3> before_, after_;
};

}  // namespace

void AmbiguousCells::emit_points(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                                 Vec3f* normals) const {
    visit_sample_type(volume_.type,
                      [&](auto sample) { emit_points_of<decltype(sample)>(row, cells, points, normals); });
}

template <class T>
void AmbiguousCells::emit_points_of(std::size_t row, std::span<const AmbiguousCell> cells, Vec3f* points,
                                    Vec3f* normals) const {
    const GridRow at(bits_, row);
    const std::int64_t y = at.y - bits_.first_y, z = at.z - bits_.first_z;
    const auto& first = to_physical_.first;
    const CornerSamples<T> samples(volume_, y, z);
    RowSlopes<T> slopes(volume_, y, z);
    for (const AmbiguousCell& cell : cells) {
        if (cell.topology.inner_points == 0) continue;
        const std::int64_t x = cell.x - bits_.first_x;
        const CellValues values = samples.minus(isovalue_, x);
        const Vec3d corner{static_cast<double>(first[0] + x), static_cast<double>(first[1] + y),
                           static_cast<double>(first[2] + z)};
        std::array<Vec3d, CellTopology::kTunnelPoints> inner;
        const int count = place_inner_points(cell.topology, values, inner);
        for (int k = 0; k < count; ++k) {
            points[k] = to_float(to_physical_.origin +
                                 to_physical_.exact * (corner + inner[static_cast<std::size_t>(k)]));
        }
        points += count;
        if (normals == nullptr) continue;
        inner_normals(slopes.of_cell(x, values), inner.data(), static_cast<std::size_t>(count), to_physical_,
                      normals);
        normals += count;
    }
}

std::uint32_t* AmbiguousCells::emit_triangles(std::size_t row, const AmbiguousCell& cell,
                                              const std::uint32_t* edge_ids, std::uint32_t first_inner,
                                              std::uint32_t* out) const {
    const std::size_t second = to_physical_.mirrored ? 2 : 1, third = 3 - second;
    const auto id = [&](std::uint8_t corner) {
        return corner < kCellEdges ? edge_ids[corner] : first_inner + (corner - kCellEdges);
    };
    const auto emit = [&](const std::uint8_t* corners, std::size_t triangles) {
        for (const std::uint8_t* const end = corners + 3 * triangles; corners != end; corners += 3) {
            *out++ = id(corners[0]);
            *out++ = id(corners[second]);
            *out++ = id(corners[third]);
        }
    };
    const CellTopology& topology = cell.topology;
    if (topology.has_tunnel()) {
        const GridRow at(bits_, row);
        CellValues values;
        visit_sample_type(volume_.type, [&](auto sample) {
            const CornerSamples<decltype(sample)> samples(volume_, at.y - bits_.first_y,
                                                          at.z - bits_.first_z);
            values = samples.minus(isovalue_, cell.x - bits_.first_x);
        });
        const TunnelTriangles triangles = triangulate_tunnel(topology, values);
        emit(triangles.corners.data(), triangles.count);
    } else {
        emit(topology.shape().corners.data(), topology.shape().triangles);
    }
    return out;
}

}  // namespace marrow::internal
