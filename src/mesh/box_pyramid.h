/// Finds the pairs of boxes that overlap, with SIMD.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "bounds.h"

namespace marrow::internal {

/// Two boxes by their numbers, the lower number first.
using BoxPair = std::array<std::uint32_t, 2>;

/// A bounding volume hierarchy without pointers: each box of a level bounds eight successive boxes of the
/// level below. So successive boxes of the lowest level should be near each other.
class BoxPyramid {
  public:
    static constexpr std::size_t kWidth = 8;
    /// The boxes that pairs_from() works on at once.
    static constexpr std::size_t kUnit = kWidth * kWidth;

    /// Takes fewer than 2^32 boxes.
    explicit BoxPyramid(const std::vector<Bounds>& boxes);

    std::size_t units() const { return levels_[1].size(); }

    /// Appends the pairs of boxes that overlap or touch and of which the first is in the given unit. The order
    /// of the pairs is fixed.
    void pairs_from(std::size_t unit, std::vector<BoxPair>& pairs) const;

    /// Appends the pairs of box i and each other box that it overlaps or touches.
    void pairs_with(std::uint32_t i, std::vector<BoxPair>& pairs) const;

    /// Replaces box i.
    void set(std::uint32_t i, const Bounds& box);

    /// Eight boxes by axis. Unused ones are empty and overlap nothing.
    struct Group {
        float lower[3][kWidth], upper[3][kWidth];

        void set(std::size_t i, const Bounds& box);
        /// The bounds of all eight.
        Bounds bounds() const;
    };

  private:
    // The groups of the boxes, then the groups of the bounds of these, up to a single group. At least two.
    std::vector<Buffer<Group>> levels_;
};

}  // namespace marrow::internal
