/// One bit a sample: inside the surface or not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/buffer.h>

namespace marrow::internal {

/// The inside bits of a grid, 64 to a word, rows along x; bits beyond a row's end are 0.
/// A closed surface is extracted on a grid with one more sample all round, all of them outside: `pad` is then
/// 1 and grid coordinates are the volume's plus one.
struct InsideBits {
    std::array<std::int64_t, 3> dims{0, 0, 0};  ///< of the grid, padding included
    int pad = 0;
    std::size_t words_per_row = 0;
    Buffer<std::uint64_t>
        words;  ///< one more than the rows need, so that a row's last word may be read across its end

    InsideBits(const std::array<std::int64_t, 3>& volume_dims, bool closed);

    std::size_t rows() const { return static_cast<std::size_t>(dims[1] * dims[2]); }
    std::size_t row_index(std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>(z * dims[1] + y);
    }
    std::uint64_t* row(std::size_t index) { return words.data() + index * words_per_row; }
    const std::uint64_t* row(std::size_t index) const { return words.data() + index * words_per_row; }
    std::size_t bytes() const { return words.size() * sizeof(std::uint64_t); }
};

}  // namespace marrow::internal
