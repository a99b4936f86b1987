/// The rows of a view.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

namespace marrow::internal {

/// The first sample of row (y, z). \pre T is the view's sample type
template <class T>
const T* row_of(const VolumeView& volume, std::int64_t y, std::int64_t z) {
    return static_cast<const T*>(volume.data) + (z * volume.slice_pitch() + y * volume.row_pitch());
}

}  // namespace marrow::internal
