/// The samples around which snapping leaves all points alone.
#pragma once

#include <array>
#include <cstdint>
#include <set>

#include <marrow/mesh.h>
#include <marrow/vector.h>

#include "core/marching_cubes/emit.h"
#include "slice.h"

namespace marrow::internal {

/// Snapped surfaces can pass through each other where two walls are close. There, points stay where they are
/// without snapping, as far as the samples that they belong to are in this set.
class UnsnappedSamples {
  public:
    explicit UnsnappedSamples(const EmitInput& input)
        : input_(input), to_index_(inverse(input.to_physical.exact)) {}

    /// Adds the corners of the cells around a triangle, and the samples up to `rings` further away.
    void add(const Mesh& mesh, const Triangle& triangle, std::int64_t rings);

    bool empty() const { return samples_.empty(); }
    std::size_t size() const { return samples_.size(); }
    /// Whether the sample nearest to a point is in the set.
    bool has_nearest_to(const Vec3f& point) const;
    /// Marks the points of slice z that belong to these samples as not near to them. So they neither merge
    /// nor move. \pre the slice is measured
    void remove_near_points(std::int64_t z, SnapSlice& slice) const;

  private:
    using Sample = std::array<std::int64_t, 3>;  // z, y and x in the grid of the inside bits

    Vec3d index_of(const Vec3f& point) const;

    const EmitInput& input_;
    const Mat3d to_index_;
    std::set<Sample> samples_;
};

}  // namespace marrow::internal
