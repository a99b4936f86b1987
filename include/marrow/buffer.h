/// Arrays that are allocated at their final size and written once.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace marrow {

/// Raw memory for large arrays; on Linux, backed by huge pages where that pays. \throw std::bad_alloc
void* allocate_pages(std::size_t bytes);
void free_pages(void* memory, std::size_t bytes) noexcept;

/// An allocator that leaves new elements uninitialised, so that output is touched once, by the thread that
/// writes it.
template <class T>
struct PageAllocator {
    using value_type = T;

    PageAllocator() = default;
    template <class U>
    PageAllocator(const PageAllocator<U>&) noexcept {}

    T* allocate(std::size_t n) { return static_cast<T*>(allocate_pages(n * sizeof(T))); }
    void deallocate(T* p, std::size_t n) noexcept { free_pages(p, n * sizeof(T)); }

    template <class U>
    void construct(U* p) noexcept {
        ::new (static_cast<void*>(p)) U;  // default-initialised: no zeros
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
    friend bool operator==(PageAllocator, PageAllocator) { return true; }
};

/// A std::vector whose resize() does not write. Elements must be written before they are read.
template <class T>
using Buffer = std::vector<T, PageAllocator<T>>;

}  // namespace marrow
