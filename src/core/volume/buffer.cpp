#include <marrow/buffer.h>

#include <sys/mman.h>

#include <cstdint>
#include <new>

namespace marrow {

namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

}  // namespace

// Of the allocation, whole huge pages are used; what is behind and before them is never touched, but for the
// allocation's address right before them. Asking for aligned memory instead would leave gaps in the heap that
// the next array of the same size does not fit into.
void* PageAllocator::allocate(std::size_t bytes) {
    if (bytes < kHugePage) return ::operator new(bytes);
    if (bytes > PTRDIFF_MAX) throw std::bad_alloc();
    const std::size_t size = (bytes + kHugePage - 1) & ~(kHugePage - 1);
    void* const allocation = ::operator new(size + kHugePage);
    const auto behind_address = reinterpret_cast<std::uintptr_t>(allocation) + sizeof(void*);
    void* const memory = reinterpret_cast<void*>((behind_address + kHugePage - 1) & ~(kHugePage - 1));
    static_cast<void**>(memory)[-1] = allocation;
    // Advice: where the system declines, pages stay small and nothing is lost but time.
    madvise(memory, size, MADV_HUGEPAGE);
    return memory;
}

void PageAllocator::deallocate(void* memory, std::size_t bytes) noexcept {
    ::operator delete(bytes < kHugePage ? memory : static_cast<void**>(memory)[-1]);
}

}  // namespace marrow
