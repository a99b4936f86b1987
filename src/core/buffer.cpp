#include <marrow/buffer.h>

#include <sys/mman.h>

#include <cstdint>

namespace marrow::internal {

void advise_huge_pages(void* begin, std::size_t bytes) noexcept {
    constexpr std::uintptr_t kHugePage = std::uintptr_t{1} << 21;
    if (bytes < 2 * kHugePage) return;
    const auto address = reinterpret_cast<std::uintptr_t>(begin);
    const std::uintptr_t first = (address + kHugePage - 1) & ~(kHugePage - 1);
    const std::uintptr_t last = (address + bytes) & ~(kHugePage - 1);
    // Advice: where the system declines, pages stay small and nothing is lost but time.
    madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
}

}  // namespace marrow::internal
