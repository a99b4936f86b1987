#include <marrow/buffer.h>

#include <cstdint>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace marrow {

namespace {

constexpr std::align_val_t kAlignment{64};

// The first touch of 4 KiB pages takes longer than writing the output; whole huge pages within the memory
// halve it.
void advise_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
    constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20;
    const auto begin = (reinterpret_cast<std::uintptr_t>(memory) + kHugePage - 1) & ~(kHugePage - 1);
    const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) & ~(kHugePage - 1);
    if (begin < end)
        madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // only advice: may fail
#endif
}

}  // namespace

void* allocate_pages(std::size_t bytes) {
    void* memory = ::operator new(bytes, kAlignment);
    advise_huge_pages(memory, bytes);
    return memory;
}

void free_pages(void* memory, std::size_t) noexcept {
    ::operator delete(memory, kAlignment);
}

}  // namespace marrow
