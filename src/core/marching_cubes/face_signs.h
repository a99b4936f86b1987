/// What rounded products show about the faces of cells, of several cells at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace marrow::internal {

/// The eight samples of a cell minus the isovalue. NaN where there is no finite sample.
using CellValues = std::array<double, 8>;

/// Cells side by side, for vectors.
class CellBatch {
  public:
    static constexpr std::size_t kCells = 8;

    void set(std::size_t cell, const CellValues& values) {
        for (std::size_t v = 0; v < 8; ++v) corners[v][cell] = values[v];
    }
    CellValues values(std::size_t cell) const {
        CellValues result;
        for (std::size_t v = 0; v < 8; ++v) result[v] = corners[v][cell];
        return result;
    }

    alignas(64) double corners[8][kCells] = {};
};

/// The signs of the determinants of a cell's faces, as far as rounding leaves no doubt. The determinant of
/// face f is that of the ring kFaceCorners[f]: the product of its corners 0 and 2 minus that of the others.
struct FaceSigns {
    static constexpr unsigned kNegative = 6, kNoWaist = 12;

    std::uint64_t bits = 0;  ///< bit f: that of face f is positive. Bit kNegative + f: it is negative.

    unsigned positive() const { return static_cast<unsigned>(bits) & 63; }
    unsigned negative() const { return static_cast<unsigned>(bits >> kNegative) & 63; }
    /// In a waist, the determinants of opposite faces have the same sign, and their
    /// mixed determinant the other one.
    bool may_have_waist() const { return (bits >> kNoWaist) == 0; }
};

/// Finds those of all cells of a batch. The same on every SIMD target.
void find_signs(const CellBatch& batch, FaceSigns (&signs)[CellBatch::kCells]);

}  // namespace marrow::internal
