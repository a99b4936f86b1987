/// Arrays that are allocated at their final size and written once.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace marrow {

namespace internal {
/// Asks the system for huge pages under a large array: the first touch of each page is what memory costs
/// most, and there are 512 times fewer.
void advise_huge_pages(void* begin, std::size_t bytes) noexcept;
}  // namespace internal

/// An allocator that leaves new elements uninitialised, so that output is touched once, by the thread that
/// writes it.
template <class T>
struct UninitializedAllocator {
    using value_type = T;

    UninitializedAllocator() = default;
    template <class U>
    UninitializedAllocator(const UninitializedAllocator<U>&) noexcept {}

    T* allocate(std::size_t n) {
        T* p = std::allocator<T>().allocate(n);
        internal::advise_huge_pages(p, n * sizeof(T));
        return p;
    }
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
