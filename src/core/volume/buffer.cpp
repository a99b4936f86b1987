// Allocates large arrays on huge pages.
#include <marrow/buffer.h>

#include <sys/mman.h>

#include <cstdint>
#include <new>

namespace marrow {

namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

}  // namespace

// The allocation is one huge page larger than needed, and the array begins at the first huge page in it. The
// rest is never touched, except for the word before the array, which holds the address of the allocation. An
// aligned allocation would be simpler, but leaves gaps in the heap that the next array of the same size does
// not fit into.
void* PageAllocator::allocate(std::size_t bytes) {
    if (bytes < kHugePage) return ::operator new(bytes);
    if (bytes > PTRDIFF_MAX) throw std::bad_alloc();
    const std::size_t size = (bytes + kHugePage - 1) & ~(kHugePage - 1);
    void* const allocation = ::operator new(size + kHugePage);
    const auto after_address = reinterpret_cast<std::uintptr_t>(allocation) + sizeof(void*);
    void* const memory = reinterpret_cast<void*>((after_address + kHugePage - 1) & ~(kHugePage - 1));
    static_cast<void**>(memory)[-1] = allocation;
    // This is only advice. If the system declines it, the pages stay small. The last page would be used in part,
    // but taken as a whole: its part stays on small pages.
    madvise(memory, bytes & ~(kHugePage - 1), MADV_HUGEPAGE);
    return memory;
}

void PageAllocator::deallocate(void* memory, std::size_t bytes) noexcept {
    ::operator delete(bytes < kHugePage ? memory : static_cast<void**>(memory)[-1]);
}

}  // namespace marrow
