/// Arrays that are allocated at their final size and written once.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace marrow {

/// An allocator that leaves new elements uninitialised, so that output is touched once, by the thread that
/// writes it.
template <class T>
struct UninitializedAllocator {
    using value_type = T;

    UninitializedAllocator() = default;
    template <class U>
    UninitializedAllocator(const UninitializedAllocator<U>&) noexcept {}

    T* allocate(std::size_t n) { return std::allocator<T>().allocate(n); }
    void deallocate(T* p, std::size_t n) noexcept { std::allocator<T>().deallocate(p, n); }

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

/// A std::vector whose resize() does not write. Elements must be written before they are read.
template <class T>
using Buffer = std::vector<T, UninitializedAllocator<T>>;

}  // namespace marrow
