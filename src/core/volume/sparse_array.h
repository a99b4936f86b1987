/// Large arrays of which only the pages in use take memory.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include <marrow/error.h>

namespace marrow::internal {

/// An array of n elements, all of whose bits are 0. A page takes memory from its first write until it is
/// released. So a pass over a part of a volume can use the indices of the whole volume.
template <class T>
class SparseArray {
  public:
    explicit SparseArray(std::size_t n) : bytes_(n * sizeof(T)) {
        if (bytes_ == 0) return;
        void* memory =
            mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (memory == MAP_FAILED)
            throw LimitError("there is no address space for " + std::to_string(bytes_ >> 20) + " MiB");
        data_ = static_cast<T*>(memory);
    }
    ~SparseArray() {
        if (data_ != nullptr) munmap(data_, bytes_);
    }
    SparseArray(SparseArray&& other) noexcept
        : bytes_(other.bytes_), data_(std::exchange(other.data_, nullptr)) {}
    SparseArray(const SparseArray&) = delete;
    SparseArray& operator=(const SparseArray&) = delete;

    T* data() { return data_; }
    const T* data() const { return data_; }

    /// Whether pages that are written from now on are huge. These are a few times faster to get and to
    /// release, but round up what is in use at both ends.
    void use_huge_pages(bool huge) {
        if (data_ != nullptr) madvise(data_, bytes_, huge ? MADV_HUGEPAGE : MADV_NOHUGEPAGE);
    }

    /// Releases the whole pages of elements [begin, end), and the rest of the page that `begin` is in. The
    /// values of all elements before `end` are lost. \pre none before `begin` is still needed
    void release(std::size_t begin, std::size_t end) {
        const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
        const auto first = reinterpret_cast<std::uintptr_t>(data_);
        // The first write after a release may have got a huge page that begins before `begin`.
        const auto from = std::max(first, reinterpret_cast<std::uintptr_t>(data_ + begin) & ~(kHugePage - 1));
        const auto to = reinterpret_cast<std::uintptr_t>(data_ + end) & ~(page - 1);
        if (from < to) madvise(reinterpret_cast<void*>(from), to - from, MADV_DONTNEED);
    }

  private:
    static constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20;

    std::size_t bytes_;
    T* data_ = nullptr;
};

}  // namespace marrow::internal
