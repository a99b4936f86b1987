/// Joins the surfaces of blocks to one mesh.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/terrain.h>

#include "ground.h"

namespace marrow::internal::terrain {

/// The mesh that consists of the surfaces of all blocks. Blocks share the points on their borders.
class JoinedMesh {
  public:
    /// `off_centre` is where the grid's centre is, in metres east and north of info.centre.
    JoinedMesh(const Grid& grid, const TerrainInfo& info, const std::array<double, 2>& off_centre)
        : grid_(grid), info_(info), off_centre_(off_centre) {}

    /// \throw LimitError more than 2^32 - 1 points
    void add(const BlockSurface& block);

    /// Easting, northing and height of the corners of all triangles from one on, computed from the mesh.
    std::vector<Vec3d> corners_from(std::size_t first_triangle, double exaggerate) const;

    /// Gives each point a unit normal: the mean of its triangles' normals, weighted by area.
    void add_normals();

    Mesh& mesh() { return mesh_; }

  private:
    double zero() const { return grid_.closed ? grid_.bottom : 0; }
    std::uint32_t index_of(const BlockSurface& block, std::uint32_t point);
    std::uint32_t append(const Vec3d& p);

    const Grid& grid_;
    const TerrainInfo& info_;
    const std::array<double, 2> off_centre_;
    Mesh mesh_;
    std::vector<std::uint32_t> index_;  // in the mesh, of each point of the current block
    std::unordered_map<std::uint64_t, std::uint32_t> index_on_edge_;
};

}  // namespace marrow::internal::terrain
