/// Resizes a buffer whose old content is of no use.
#pragma once

#include <cstddef>

#include <marrow/buffer.h>

namespace marrow::internal {

/// Resizes `buffer` without copying its old elements into a new allocation. The elements are uninitialised.
template <class T>
void resize_discarding(Buffer<T>& buffer, std::size_t size) {
    buffer.clear();
    buffer.resize(size);
}

}  // namespace marrow::internal
