/// One bit per sample: whether it is inside the surface.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>

#include "base/checked_size.h"

namespace marrow::internal {

/// The sides of a volume at which its surface is closed: by axis, before the first sample and after the last.
struct ClosedSides {
    std::array<bool, 3> below{}, above{};

    static ClosedSides all(bool closed) {
        const std::array<bool, 3> sides{closed, closed, closed};
        return {sides, sides};
    }
};

/// The inside bits of a grid of rows along x, 64 per word. Bits after a row's end are 0.
///
/// A surface that is closed at a side is extracted on a larger grid, with outside samples beyond that side:
/// one more slice or row of them. Along x a whole word of zeros precedes the samples, so that samples and
/// bits have the same alignment; zeros follow them.
struct InsideBits {
    std::int64_t first_x = 0;     ///< the bit of a row's first sample
    std::int64_t first_y = 0;     ///< the volume's first row: 1 if the surface is closed before it, else 0
    std::int64_t first_z = 0;     ///< the same for slices
    std::int64_t cells_x = 0;     ///< a cell starts at each bit of a row below this one
    std::int64_t ny = 0, nz = 0;  ///< rows and slices of the grid, including those beyond the volume
    std::size_t words_per_row = 0;
    /// This many words after the last row may be read, so that vectors need not stop at the end of a row.
    /// Their values have no meaning.
    static constexpr std::size_t kSlack = 16;
    Buffer<std::uint64_t> owned;  ///< empty if the words are borrowed memory
    std::uint64_t* words = nullptr;

    InsideBits(const std::array<std::int64_t, 3>& volume_dims, const ClosedSides& closed)
        : InsideBits(volume_dims, closed, nullptr) {
        owned.resize(word_count() + kSlack);
        std::fill_n(owned.end() - kSlack, kSlack, std::uint64_t{0});
        words = owned.data();
    }
    /// \throw LimitError more rows than memory can hold
    /// Uses `memory` of word_count() + kSlack words, which must outlive this object.
    InsideBits(const std::array<std::int64_t, 3>& volume_dims, const ClosedSides& closed,
               std::uint64_t* memory)
        : first_x(closed.below[0] ? 64 : 0),
          first_y(closed.below[1]),
          first_z(closed.below[2]),
          cells_x(first_x + volume_dims[0] - 1 + closed.above[0]),
          ny(volume_dims[1] + closed.below[1] + closed.above[1]),
          nz(volume_dims[2] + closed.below[2] + closed.above[2]),
          words(memory) {
        // The zero after the last sample of a full row is in the word of zeros before the next row, if there
        // is one.
        const bool needs_zero = closed.above[0] && !closed.below[0];
        words_per_row = static_cast<std::size_t>((first_x + volume_dims[0] + needs_zero + 63) / 64);
        // So that no number of rows or words is cut off.
        checked_size(words_per_row * static_cast<std::uint64_t>(ny * nz) + kSlack, sizeof(std::uint64_t));
    }
    InsideBits(const InsideBits&) = delete;
    InsideBits& operator=(const InsideBits&) = delete;

    /// The bits of a row's last word at which cells start.
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

/// The position of a row in the grid, for loops over rows.
struct GridRow {
    std::size_t index;
    std::int64_t y, z;

    GridRow(const InsideBits& bits, std::size_t row)
        : index(row),
          y(static_cast<std::int64_t>(row) % bits.ny),
          z(static_cast<std::int64_t>(row) / bits.ny) {}
    GridRow(const InsideBits& bits, std::int64_t row_y, std::int64_t row_z)
        : index(bits.row_index(row_y, row_z)), y(row_y), z(row_z) {}
    void advance(const InsideBits& bits) {
        ++index;
        if (++y == bits.ny) y = 0, ++z;
    }
};

/// The level above the inside bits: one bit for each word of a row. It is set if the surface may cross an
/// edge or a cell that starts at one of the word's samples. After counting, only these words are visited.
struct ActiveWords {
    explicit ActiveWords(const InsideBits& bits)
        : masks_per_row(masks_per_row_of(bits)), masks(masks_per_row * bits.rows()) {}

    static std::size_t masks_per_row_of(const InsideBits& bits) { return (bits.words_per_row + 63) / 64; }

    std::size_t masks_per_row;
    Buffer<std::uint64_t> masks;

    std::uint64_t* row(std::size_t index) { return masks.data() + index * masks_per_row; }
    const std::uint64_t* row(std::size_t index) const { return masks.data() + index * masks_per_row; }
    std::size_t bytes() const { return masks.size() * sizeof(std::uint64_t); }
};

}  // namespace marrow::internal
