/// Views of a part with samples around it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/volume.h>

namespace marrow::internal {

/// The view with `before` samples more before it and `after` samples more after it, along each axis.
/// \pre `below` and `above` have as many
inline VolumeView enlarged(const VolumeView& part, const std::array<std::int64_t, 3>& before,
                           const std::array<std::int64_t, 3>& after) {
    VolumeView view = part;
    view.pitch = {part.row_pitch(), part.slice_pitch()};
    const std::array<std::int64_t, 3> step{1, part.row_pitch(), part.slice_pitch()};
    std::int64_t offset = 0;
    for (std::size_t a = 0; a < 3; ++a) {
        view.first[a] -= before[a];
        view.below[a] -= before[a];
        view.above[a] -= after[a];
        view.geometry.dims[a] += before[a] + after[a];
        offset += before[a] * step[a];
    }
    view.data =
        static_cast<const std::byte*>(part.data) - offset * static_cast<std::int64_t>(sample_size(part.type));
    return view;
}

}  // namespace marrow::internal
