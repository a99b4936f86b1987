/// The places where snapping does less, because the surface would pass through itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>

#include <marrow/mesh.h>
#include <marrow/vector.h>

#include "core/marching_cubes/emit.h"
#include "merge_clusters.h"

namespace marrow::internal {

/// Snapped surfaces can pass through each other where two walls are close. Around the samples of one set,
/// points do not merge. Around those of another, caps are not widened either. Points that only move along
/// their edges leave the surface valid, as far as float32 can hold them: it is that of other samples with the
/// same inside bits.
class SnapExceptions {
  public:
    explicit SnapExceptions(const EmitInput& input)
        : input_(input), to_index_(inverse(input.to_physical.exact)) {}

    /// Adds the samples nearest to the corners of a triangle, and those up to `rings` further away: to the
    /// first set, and those that are there already to the second.
    void add(const Mesh& mesh, const Triangle& triangle, std::int64_t rings);

    /// Whether neither merging nor widening caps can have an effect on a triangle any more.
    bool are_exhausted(const Mesh& mesh, const Triangle& triangle) const;
    bool forbid_any_widening() const { return !unwidened_.empty(); }
    /// Returns the slices of the samples that were added since the last call, also if they were there
    /// already.
    std::set<std::int64_t> take_changed_slices() { return std::exchange(changed_slices_, {}); }
    /// Marks the clusters of a slice that may not merge.
    void forbid_merging(const SliceMerge& merge) const;
    /// Whether caps at this point may not be widened.
    bool forbid_widening(const Vec3f& point) const { return unwidened_.count(sample_nearest_to(point)) > 0; }

  private:
    using Sample = std::array<std::int64_t, 3>;  // z, y and x in the grid of the inside bits

    Sample sample_nearest_to(const Vec3f& point) const;
    // The samples nearest to the corners of a triangle, and those up to `rings` further away.
    // Calls f for the samples up to `rings` from those nearest to the corners, until it returns false.
    // Returns whether it never did.
    template <class F>
    bool for_each_sample_around(const Mesh& mesh, const Triangle& triangle, std::int64_t rings,
                                const F& f) const;

    const EmitInput& input_;
    const Mat3d to_index_;
    std::set<Sample> unmerged_, unwidened_;
    std::set<std::int64_t> changed_slices_;
};

}  // namespace marrow::internal
