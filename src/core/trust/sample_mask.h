/// One bit for each sample of a volume, and the samples around points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/volume.h>

namespace marrow::internal {

/// The samples from `lower` to `upper`, both included.
struct SampleBox {
    std::array<std::int64_t, 3> lower, upper;
};

/// The samples of the cells that touch a position, as far as they are in the volume. The position is an index. It may be
/// rounded: a position very close to a sample is on it.
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
    /// Inserts the neighbours of all samples, up to 26 each.
    void dilate() {
        const auto row = static_cast<std::size_t>(words_per_row_),
                   slice = row * static_cast<std::size_t>(dims_[1]);
        for (std::size_t begin = 0; begin < words_.size(); begin += row) dilate_row(&words_[begin]);
        for (std::size_t begin = 0; begin < words_.size(); begin += slice)
            dilate_pieces(&words_[begin], row, slice);
        dilate_pieces(words_.data(), slice, words_.size());
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
    /// The words of a row: bit i % 64 of word i / 64 belongs to sample i.
    std::span<const std::uint64_t> row(std::int64_t y, std::int64_t z) const {
        return {&words_[word(0, y, z)], static_cast<std::size_t>(words_per_row_)};
    }

  private:
    std::size_t word(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>((z * dims_[1] + y) * words_per_row_ + x / 64);
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

    // Joins each of the pieces of `step` words with those before and after it.
    static void dilate_pieces(std::uint64_t* words, std::size_t step, std::size_t size) {
        std::vector<std::uint64_t> before(step), own(step);
        for (std::size_t begin = 0; begin < size; begin += step, before.swap(own)) {
            std::uint64_t* const piece = words + begin;
            std::copy_n(piece, step, own.begin());
            const bool is_last = begin + step == size;
            for (std::size_t i = 0; i < step; ++i) piece[i] |= before[i] | (is_last ? 0 : piece[step + i]);
        }
    }

    std::array<std::int64_t, 3> dims_;
    std::int64_t words_per_row_;
    std::vector<std::uint64_t> words_;
};

}  // namespace marrow::internal
