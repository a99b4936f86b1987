/// Arrays that are allocated at their final size and written once.
#pragma once

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

#include <marrow/export.h>

namespace marrow {

/// Memory for large arrays, aligned to huge pages. Touching a page for the first time is the largest cost of
/// large arrays, and with huge pages there are 512 times fewer of them. Systems without huge pages use normal
/// ones.
struct MARROW_EXPORT PageAllocator {
    /// Allocates `bytes` of uninitialised memory. \throw std::bad_alloc
    static void* allocate(std::size_t bytes);
    /// Frees what allocate() returned for the same number of bytes.
    static void deallocate(void* memory, std::size_t bytes) noexcept;
};

/// An allocator that leaves new elements uninitialised. So the output is touched only once, by the thread
/// that writes it.
template <class T>
struct UninitializedAllocator {
    using value_type = T;

    UninitializedAllocator() = default;
    template <class U>
    UninitializedAllocator(const UninitializedAllocator<U>&) noexcept {}

    T* allocate(std::size_t n) { return static_cast<T*>(PageAllocator::allocate(n * sizeof(T))); }
    void deallocate(T* p, std::size_t n) noexcept { PageAllocator::deallocate(p, n * sizeof(T)); }

    template <class U>
    void construct(U* p) noexcept {
        ::new (static_cast<void*>(p)) U;  // default-initialised: no zeros
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
    friend bool operator==(UninitializedAllocator, UninitializedAllocator) { return true; }
};

/// A std::vector whose resize() leaves new elements uninitialised: write them before you read them.
template <class T>
using Buffer = std::vector<T, UninitializedAllocator<T>>;

}  // namespace marrow
