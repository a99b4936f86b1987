/// Turns 64-bit counts into sizes of memory, which have 32 bits on some machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <marrow/error.h>

namespace marrow::internal {

/// The number of elements of an array, as a size. \throw LimitError no array can
/// have so many elements of this size
inline std::size_t checked_size(std::uint64_t count, std::size_t element_size = 1) {
    if (count > static_cast<std::uint64_t>(PTRDIFF_MAX) / element_size)
        throw LimitError(std::to_string(count) + " elements of " + std::to_string(element_size) +
                         " bytes are more than memory can hold");
    return static_cast<std::size_t>(count);
}

}  // namespace marrow::internal
