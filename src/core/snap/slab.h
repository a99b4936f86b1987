/// Snaps a slab of slices by itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

#include "base/parallel.h"
#include "core/marching_cubes/emit.h"
#include "merge_clusters.h"
#include "slice.h"
#include "snap_exceptions.h"
#include "snap_output.h"

namespace marrow::internal {

/// The results of merging for the points of the last three slices, as arrays indexed by point number.
class PointWindow {
  public:
    /// The point that each merges into, and later the index of that point in the output.
    std::uint32_t* representatives() { return representatives_.data() - begin_; }
    /// How far each was moved, in edges.
    float* moved() { return moved_.data() - begin_; }
    /// The x of the sample at which the edge of each starts, in the grid of the inside bits.
    std::uint32_t* edge_x() { return edge_x_.data() - begin_; }

    /// Adds the points [next, end), which represent themselves, and forgets those before `first`.
    void append(std::uint32_t first, std::uint32_t next, std::uint32_t end);
    std::size_t bytes() const {
        return representatives_.size() * (sizeof representatives_[0] + sizeof moved_[0] + sizeof edge_x_[0]);
    }

  private:
    Buffer<std::uint32_t> representatives_;
    Buffer<float> moved_;
    Buffer<std::uint32_t> edge_x_;
    std::uint32_t begin_ = 0;  // the number of the first point
};

/// Makes the points of the slices [begin, end) and the triangles of the cells that start at their samples. It
/// also processes a few slices before and after these, so that it decides as the neighbouring slabs do.
/// Before snapping, points are numbered from the first point of the first slice that is processed. In the
/// output, they are numbered from the first point of slice `begin`.
class SnapSlab {
  public:
    SnapSlab(const EmitInput& input, const SnapExceptions& exceptions, float limit, bool normals,
             std::int64_t begin, std::int64_t end);

    /// Makes the output, with a step for each slice of the slab. \throw Cancelled; std::bad_alloc
    void run(Stage& stage);

    std::int64_t begin() const { return begin_; }
    /// The bytes of memory in use. Output that was moved to a mesh does not count.
    std::size_t bytes() const;

    SnapOutput output;

  private:
    SnapSlice& slice(std::int64_t z) { return slices_[static_cast<std::size_t>(z + 3) % 3]; }
    std::uint64_t first_output(const HistoPyramid& pyramid, std::int64_t z) const;

    void reserve();
    void make_points(std::int64_t z);
    void merge_slice(std::int64_t z);
    void number_points(std::int64_t z);
    void make_triangles(std::int64_t z);
    std::size_t renumber_layer(std::int64_t z);
    std::size_t renumber_row(std::size_t first, std::size_t count, std::uint32_t first_cell, std::size_t to);
    void list_caps(std::size_t count);

    const EmitInput& input_;
    const SnapExceptions& exceptions_;
    const float limit_;
    const bool normals_wanted_;
    const CellNumbers cell_numbers_;
    const std::int64_t begin_, end_;
    const std::int64_t first_, last_;  // the first and the last slice that are processed
    const std::uint64_t first_point_;  // the first point of slice first_ in the output without snapping
    std::array<SnapSlice, 3> slices_;
    Clusters clusters_;
    PointWindow window_;
    std::uint32_t point_count_ = 0;
    std::uint64_t triangle_count_ = 0;
    Buffer<Triangle> layer_;               // the unsnapped triangles between two slices
    Buffer<std::uint32_t> layer_indices_;  // the indices in the layer of those that did not collapse
    std::vector<std::uint32_t> cap_indices_;
};

}  // namespace marrow::internal
