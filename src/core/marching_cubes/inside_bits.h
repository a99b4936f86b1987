/// One bit a sample: inside the surface or not.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>

namespace marrow::internal {

/// The inside bits of a grid of rows along x, 64 to a word; bits behind a row's end are 0.
/// A closed surface is extracted on a grid with outside all round: a slice more at both ends of z, a row more
/// at both ends of y, and along x a whole word of zeros before the samples, so that theirs stay aligned;
/// behind them follow zeros.
struct InsideBits {
    int pad = 0;                  ///< 1 for a closed surface: grid y and z are the volume's plus one
    std::int64_t first_x = 0;     ///< the bit of a row's first sample
    std::int64_t cells_x = 0;     ///< a cell starts at each of a row's bits below this
    std::int64_t ny = 0, nz = 0;  ///< rows of the grid, those around the volume included
    std::size_t words_per_row = 0;
    /// Words behind the last row that may be read (their values mean nothing), so that vectors need not stop
    /// at a row's end.
    static constexpr std::size_t kSlack = 16;
    Buffer<std::uint64_t> owned;  ///< empty where the words lie in borrowed memory
    std::uint64_t* words = nullptr;

    InsideBits(const std::array<std::int64_t, 3>& volume_dims, bool closed)
        : InsideBits(volume_dims, closed, nullptr) {
        owned.resize(word_count() + kSlack);
        std::fill_n(owned.end() - kSlack, kSlack, std::uint64_t{0});
        words = owned.data();
    }
    /// In memory of word_count() + kSlack words that outlives it.
    InsideBits(const std::array<std::int64_t, 3>& volume_dims, bool closed, std::uint64_t* memory)
        : pad(closed ? 1 : 0),
          first_x(64 * pad),
          cells_x(first_x + volume_dims[0] - 1 + pad),
          ny(volume_dims[1] + 2 * pad),
          nz(volume_dims[2] + 2 * pad),
          words_per_row(static_cast<std::size_t>((first_x + volume_dims[0] + 63) / 64)),
          words(memory) {}
    InsideBits(const InsideBits&) = delete;
    InsideBits& operator=(const InsideBits&) = delete;

    /// The bits of a row's last word at which a cell starts.
    std::uint64_t last_cells() const {
        const std::int64_t cells = cells_x - 64 * static_cast<std::int64_t>(words_per_row - 1);
        return cells == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << cells) - 1;
    }

    std::size_t word_count() const { return words_per_row * rows(); }
    std::size_t rows() const { return static_cast<std::size_t>(ny * nz); }
    std::size_t row_index(std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>(z * ny + y);
    }
    std::uint64_t* row(std::size_t index) { return words + index * words_per_row; }
    const std::uint64_t* row(std::size_t index) const { return words + index * words_per_row; }
    std::size_t bytes() const { return word_count() * sizeof(std::uint64_t); }
};

/// The level above the bits: a bit for each of a row's words, set where the surface may touch the edges or the
/// cells that start at the word's samples. What comes after counting looks at these words only.
struct ActiveWords {
    explicit ActiveWords(const InsideBits& bits)
        : masks_per_row((bits.words_per_row + 63) / 64), masks(masks_per_row * bits.rows()) {}

    std::size_t masks_per_row;
    Buffer<std::uint64_t> masks;

    std::uint64_t* row(std::size_t index) { return masks.data() + index * masks_per_row; }
    const std::uint64_t* row(std::size_t index) const { return masks.data() + index * masks_per_row; }
    std::size_t bytes() const { return masks.size() * sizeof(std::uint64_t); }
};

}  // namespace marrow::internal
