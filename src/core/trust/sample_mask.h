/// One bit for each sample of a volume, and the samples around points.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include <marrow/volume.h>

namespace marrow::internal {

/// The samples from `lower` to `upper`, both included.
struct SampleBox {
    std::array<std::int64_t, 3> lower, upper;
};

/// The samples of the cells that touch a position, and their neighbours, as far as they are in the volume. The position
/// is an index. It may be rounded: a position very close to a sample is on it.
inline SampleBox samples_around(const Vec3d& index, const std::array<std::int64_t, 3>& dims) {
    constexpr double kRounding = 0.01;
    SampleBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        const double last = static_cast<double>(dims[a] - 1);
        box.lower[a] = static_cast<std::int64_t>(std::clamp(std::floor(index[a] + kRounding) - 1, 0.0, last));
        box.upper[a] = static_cast<std::int64_t>(std::clamp(std::ceil(index[a] - kRounding) + 1, 0.0, last));
    }
    return box;
}

/// A set of samples.
class SampleMask {
  public:
    explicit SampleMask(const std::array<std::int64_t, 3>& dims)
        : dims_(dims),
          words_per_row_((dims[0] + 63) / 64),
          words_(static_cast<std::size_t>(words_per_row_ * dims[1] * dims[2])) {}

    bool has(const std::array<std::int64_t, 3>& index) const {
        return (words_[word(index[0], index[1], index[2])] >> (index[0] % 64) & 1) != 0;
    }
    void insert(const std::array<std::int64_t, 3>& index) {
        words_[word(index[0], index[1], index[2])] |= std::uint64_t{1} << (index[0] % 64);
    }
    /// Inserts a box. \pre it is at most 64 samples wide
    void insert(const SampleBox& box) {
        const std::uint64_t bits = ~std::uint64_t{0} >> (63 - (box.upper[0] - box.lower[0]));
        const int shift = static_cast<int>(box.lower[0] % 64);
        const bool crosses = box.lower[0] / 64 != box.upper[0] / 64;
        for (std::int64_t z = box.lower[2]; z <= box.upper[2]; ++z) {
            for (std::int64_t y = box.lower[1]; y <= box.upper[1]; ++y) {
                std::uint64_t* const first = &words_[word(box.lower[0], y, z)];
                first[0] |= bits << shift;
                if (crosses) first[1] |= bits >> (64 - shift);
            }
        }
    }
    /// Whether a sample of the box is in the set.
    bool has_any(const SampleBox& box) const {
        for (std::int64_t z = box.lower[2]; z <= box.upper[2]; ++z) {
            for (std::int64_t y = box.lower[1]; y <= box.upper[1]; ++y) {
                for (std::int64_t x = box.lower[0]; x <= box.upper[0]; ++x) {
                    if (has({x, y, z})) return true;
                }
            }
        }
        return false;
    }
    /// Calls f with the x of each sample of a row, in order.
    template <class F>
    void for_each_in_row(std::int64_t y, std::int64_t z, const F& f) const {
        for (std::int64_t w = 0; w < words_per_row_; ++w) {
            std::uint64_t bits = words_[word(64 * w, y, z)];
            for (; bits != 0; bits &= bits - 1) f(64 * w + std::countr_zero(bits));
        }
    }

  private:
    std::size_t word(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>((z * dims_[1] + y) * words_per_row_ + x / 64);
    }

    std::array<std::int64_t, 3> dims_;
    std::int64_t words_per_row_;
    std::vector<std::uint64_t> words_;
};

}  // namespace marrow::internal
