// Counts the points in each cell of a grid, and cuts the curve through the cells into regions.
#include "point_regions.h"

#include <algorithm>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "mesh/search/morton_curve.h"

namespace marrow::internal {

Buffer<std::uint16_t> divide_points(const MeshView& mesh, std::size_t count) {
    constexpr std::uint32_t kAxisCells = 64;
    const std::span<const Vec3f> points = mesh.points;
    const CellKeys cells(bounds_of_triangles(mesh), kAxisCells, kAxisCells - 1);
    std::vector<std::size_t> points_in(kAxisCells * kAxisCells * kAxisCells, 0);
    for (const Vec3f& p : points) ++points_in[cells.at(p)];
    std::vector<std::uint16_t> region_of_cell;
    region_of_cell.reserve(points_in.size());
    std::size_t before = 0;
    for (const std::size_t in_cell : points_in) {
        // The region of the middle one of the cell's points.
        const std::size_t middle = before + in_cell / 2;
        region_of_cell.push_back(
            static_cast<std::uint16_t>(1 + std::min(middle * count / points.size(), count - 1)));
        before += in_cell;
    }
    Buffer<std::uint16_t> regions(points.size());
    parallel_for_ranges(std::size_t{0}, points.size(), 4096, [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p)
            regions[p] = region_of_cell[cells.at(points[p])];
    });
    return regions;
}

}  // namespace marrow::internal
