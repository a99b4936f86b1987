/// Finds the few samples that can be in the middle of a wall, many at a time.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

namespace marrow::internal {

/// The sides of a ridge are looked for within this many samples.
inline constexpr std::int64_t kReach = 3;

/// How high a wall is that does not clearly reach an isovalue. Its contrast is its height over its base.
struct WallLimits {
    double isovalue;
    double least_contrast;
    double least_part, most_part;  ///< of the contrast, as parts of what it would take to reach the isovalue
};

/// Clears the bits of samples that cannot be in the middle of such a wall. Bit i % 64 of words[i / 64]
/// belongs to sample i of the row (y, z). What is left are peaks along some axis, no lower than the sample
/// before them and higher than the one after. Their base is the higher one of the lowest samples within reach
/// on both sides. Limits are kept but for rounding. Words without bits are not looked at.
void keep_peaks(const VolumeView& volume, const WallLimits& limits, std::int64_t y, std::int64_t z,
                std::uint64_t* words);

}  // namespace marrow::internal
