#include <marrow/buffer.h>

#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace marrow {

namespace {

// Above this, memory comes in huge pages: the first touch of 4 KiB pages costs more than writing the output.
constexpr std::size_t kHugePage = std::size_t{2} << 20;
constexpr std::size_t kLarge = 2 * kHugePage;

}  // namespace

void* allocate_pages(std::size_t bytes) {
    if (bytes < kLarge) return ::operator new (bytes, std::align_val_t{64});
    void* memory = ::operator new (bytes, std::align_val_t{kHugePage});
#if defined(__linux__)
    madvise(memory, bytes, MADV_HUGEPAGE);  // advice: where it is not taken, small pages do
#endif
    return memory;
}

void free_pages(void* memory, std::size_t bytes) noexcept {
    ::operator delete (memory, std::align_val_t{bytes < kLarge ? 64 : kHugePage});
}

}  // namespace marrow
