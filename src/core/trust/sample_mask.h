/// One bit for each sample of a volume, and the samples around points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/volume.h>

#include "core/volume/sparse_array.h"

namespace marrow::internal {

/// The samples from `lower` to `upper`, both included.
struct SampleBox {
    std::array<std::int64_t, 3> lower, upper;
};

/// The samples of the cells that touch a position, as far as they are in the volume. The position is an
/// index. It may be rounded: a position very close to a sample is on it.
inline SampleBox samples_at(const Vec3d& index, const std::array<std::int64_t, 3>& dims) {
    constexpr double kRounding = 0.01;
    SampleBox box;
    for (std::size_t a = 0; a < 3; ++a) {
        const double last = static_cast<double>(dims[a] - 1);
        // What is not negative is truncated to its floor. std::floor and std::ceil would be calls.
        box.lower[a] = static_cast<std::int64_t>(std::clamp(index[a] + kRounding, 0.0, last));
        box.upper[a] =
            dims[a] - 1 - static_cast<std::int64_t>(last - std::clamp(index[a] - kRounding, 0.0, last));
    }
    return box;
}

/// A set of samples. Only the parts of a volume that have any take memory.
class SampleMask {
  public:
    explicit SampleMask(const std::array<std::int64_t, 3>& dims)
        : dims_(dims),
          words_per_row_((dims[0] + 63) / 64),
          filled_(static_cast<std::size_t>(dims[1] * dims[2])),
          words_(filled_.size() * static_cast<std::size_t>(words_per_row_)) {}

    bool has(const std::array<std::int64_t, 3>& index) const {
        return (word(index[0], index[1], index[2]) >> (index[0] % 64) & 1) != 0;
    }
    void insert(const std::array<std::int64_t, 3>& index) {
        words_.data()[place(index[0], index[1], index[2])] |= std::uint64_t{1} << (index[0] % 64);
        filled_[row_number(index[1], index[2])] = 1;
    }
    /// Inserts a box. \pre it is at most 64 samples wide
    void insert(const SampleBox& box) {
        const std::uint64_t bits = ~std::uint64_t{0} >> (63 - (box.upper[0] - box.lower[0]));
        const int shift = static_cast<int>(box.lower[0] % 64);
        const bool crosses = box.lower[0] / 64 != box.upper[0] / 64;
        for (std::int64_t z = box.lower[2]; z <= box.upper[2]; ++z) {
            for (std::int64_t y = box.lower[1]; y <= box.upper[1]; ++y) {
                std::uint64_t* const first = words_.data() + place(box.lower[0], y, z);
                first[0] |= bits << shift;
                if (crosses) first[1] |= bits >> (64 - shift);
                filled_[row_number(y, z)] = 1;
            }
        }
    }
    /// Inserts the neighbours of all samples, up to 26 each.
    void dilate() {
        const auto rows = static_cast<std::size_t>(dims_[1]);
        for (std::size_t row = 0; row < filled_.size(); ++row) {
            if (filled_[row] != 0) dilate_row(words_.data() + row * static_cast<std::size_t>(words_per_row_));
        }
        for (std::size_t slice = 0; slice < filled_.size(); slice += rows) dilate_pieces(slice, 1, rows);
        dilate_pieces(0, rows, filled_.size());
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
    /// Whether a row may have samples.
    bool has_row(std::int64_t y, std::int64_t z) const { return filled_[row_number(y, z)] != 0; }
    /// The words of a row: bit i % 64 of word i / 64 belongs to sample i.
    std::span<std::uint64_t> row(std::int64_t y, std::int64_t z) {
        return {words_.data() + place(0, y, z), static_cast<std::size_t>(words_per_row_)};
    }
    /// The word of a sample, which has it at bit x % 64.
    std::uint64_t word(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return words_.data()[place(x, y, z)];
    }

  private:
    std::size_t place(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return row_number(y, z) * static_cast<std::size_t>(words_per_row_) + static_cast<std::size_t>(x / 64);
    }
    std::size_t row_number(std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>(z * dims_[1] + y);
    }

    void dilate_row(std::uint64_t* row) {
        std::uint64_t before = 0;
        for (std::int64_t w = 0; w < words_per_row_; ++w) {
            const std::uint64_t own = row[w], after = w + 1 < words_per_row_ ? row[w + 1] : 0;
            row[w] = own | own << 1 | own >> 1 | before >> 63 | after << 63;
            before = own;
        }
        if (dims_[0] % 64 != 0) row[words_per_row_ - 1] &= ~(~std::uint64_t{0} << dims_[0] % 64);
    }

    // Of `count` rows from `first` on, joins each piece of `step` rows with those before and after it. Rows
    // that stay empty are not touched, so that they take no memory.
    void dilate_pieces(std::size_t first, std::size_t step, std::size_t count) {
        const auto width = static_cast<std::size_t>(words_per_row_);
        std::vector<std::uint64_t> before(step * width), own(step * width);
        std::vector<std::uint8_t> before_filled(step), own_filled(step);
        for (std::size_t begin = first; begin < first + count; begin += step) {
            const bool is_last = begin + step == first + count;
            for (std::size_t k = 0; k < step; ++k) {
                const bool after_filled = !is_last && filled_[begin + k + step] != 0;
                own_filled[k] = filled_[begin + k];
                if (before_filled[k] == 0 && own_filled[k] == 0 && !after_filled) continue;
                filled_[begin + k] = 1;
                std::uint64_t* const row = words_.data() + (begin + k) * width;
                std::copy_n(row, width, &own[k * width]);
                for (std::size_t w = 0; w < width; ++w) {
                    row[w] |= (before_filled[k] != 0 ? before[k * width + w] : 0) |
                              (after_filled ? row[step * width + w] : 0);
                }
            }
            before.swap(own);
            before_filled.swap(own_filled);
        }
    }

    std::array<std::int64_t, 3> dims_;
    std::int64_t words_per_row_;
    std::vector<std::uint8_t> filled_;  // for each row whether it may have samples
    SparseArray<std::uint64_t> words_;
};

}  // namespace marrow::internal
