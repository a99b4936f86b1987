/// Arrays of which only the parts in use take memory.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include <marrow/error.h>

namespace marrow::internal {

/// n elements of address space, uninitialised: pages take memory from when they are written until they are released.
/// Lets the passes run on parts of a volume with the indices of the whole.
template <class T>
class SparseArray {
  public:
    explicit SparseArray(std::size_t n) : bytes_(n * sizeof(T)) {
        if (bytes_ == 0) return;
        void* memory =
            mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (memory == MAP_FAILED)
            throw LimitError("no address space for " + std::to_string(bytes_ >> 20) + " MiB");
        data_ = static_cast<T*>(memory);
    }
    ~SparseArray() {
        if (data_ != nullptr) munmap(data_, bytes_);
    }
    SparseArray(const SparseArray&) = delete;
    SparseArray& operator=(const SparseArray&) = delete;

    T* data() { return data_; }

    /// Gives back the memory of elements [begin, end), as far as it makes whole pages; their values are lost.
    void release(std::size_t begin, std::size_t end) {
        const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
        const auto from = (reinterpret_cast<std::uintptr_t>(data_ + begin) + page - 1) & ~(page - 1);
        const auto to = reinterpret_cast<std::uintptr_t>(data_ + end) & ~(page - 1);
        if (from < to) madvise(reinterpret_cast<void*>(from), to - from, MADV_DONTNEED);
    }

  private:
    std::size_t bytes_;
    T* data_ = nullptr;
};

}  // namespace marrow::internal
