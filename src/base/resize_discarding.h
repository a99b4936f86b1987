/// Resizes a buffer whose old content is of no use.
#pragma once

#include <cstdint>

#include <marrow/buffer.h>

#include "checked_size.h"

namespace marrow::internal {

/// Resizes `buffer` without copying its old elements into a new allocation. The elements are uninitialised.
/// \throw LimitError
template <class T>
void resize_discarding(Buffer<T>& buffer, std::uint64_t size) {
    buffer.clear();
    buffer.resize(checked_size(size, sizeof(T)));
}

}  // namespace marrow::internal
