// Allocates large arrays where there are no huge pages.
#include <new>

#include <marrow/buffer.h>

namespace marrow {

void* PageAllocator::allocate(std::size_t bytes) {
    return ::operator new(bytes);
}

void PageAllocator::deallocate(void* memory, std::size_t) noexcept {
    ::operator delete(memory);
}

}  // namespace marrow
