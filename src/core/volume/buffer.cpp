// Allocates large arrays on huge pages.
#include <marrow/buffer.h>

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <new>

namespace marrow {

namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

// How much of an array is on huge pages. The system takes about as long for a huge page as for eighty small
// ones, so the last page is huge too if the array uses a quarter of it.
std::size_t on_huge_pages(std::size_t bytes) {
    return (bytes + kHugePage * 3 / 4) & ~(kHugePage - 1);
}

}  // namespace

// The allocation is one huge page larger than needed, and the array begins at the first huge page in it. The
// rest is never touched, except for the word before the array, which holds the address of the allocation. An
// aligned allocation would be simpler, but leaves gaps in the heap that the next array of the same size does
// not fit into.
void* PageAllocator::allocate(std::size_t bytes) {
    if (bytes > PTRDIFF_MAX) throw std::bad_alloc();
    const std::size_t huge = on_huge_pages(bytes);
    if (huge == 0) return ::operator new(bytes);
    void* const allocation = ::operator new(std::max(bytes, huge) + kHugePage);
    const auto after_address = reinterpret_cast<std::uintptr_t>(allocation) + sizeof(void*);
    void* const memory = reinterpret_cast<void*>((after_address + kHugePage - 1) & ~(kHugePage - 1));
    static_cast<void**>(memory)[-1] = allocation;
    // This is only advice. If the system declines it, the pages stay small.
    madvise(memory, huge, MADV_HUGEPAGE);
    return memory;
}

void PageAllocator::deallocate(void* memory, std::size_t bytes) noexcept {
    ::operator delete(on_huge_pages(bytes) == 0 ? memory : static_cast<void**>(memory)[-1]);
}

}  // namespace marrow
