/// A snapped surface, with what is needed to make parts of it again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/mesh.h>

#include "cap_triangles.h"
#include "core/marching_cubes/inside_bits.h"

namespace marrow::internal {

/// Numbers the cells of a layer of cells, in the order of their triangles. Between the last cell of a row and
/// the first one of the next there are numbers that no cell has. So cells that are neighbours in the grid,
/// and only these, have numbers that differ by one of nine amounts.
struct CellNumbers {
    explicit CellNumbers(const InsideBits& bits) : per_row(64 * bits.words_per_row + 2) {}

    std::uint64_t of(std::size_t x, std::size_t y) const { return (y + 1) * per_row + x + 1; }
    /// The numbers of a layer are below this. A larger one does not fit into SnapOutput.
    std::uint64_t end(const InsideBits& bits) const {
        return (static_cast<std::uint64_t>(bits.ny) + 2) * per_row;
    }

    std::uint64_t per_row;
};

/// Where the output of a slice begins: its points, and the triangles of the cells between it and the next.
struct SliceStart {
    std::uint64_t point = 0, triangle = 0, cap = 0;
};

/// The snapped surface of some successive slices. The triangles of a layer are ordered by cells.
struct SnapOutput {
    Mesh mesh;
    Buffer<std::uint32_t> cells;  ///< the number of each triangle's cell in its layer
    std::vector<CapTriangle> caps;
    std::vector<SliceStart> starts;  ///< of each slice, and after the last one

    std::size_t slices() const { return starts.size() - 1; }
    std::size_t bytes() const;
};

/// The output of the slices from `begin` on that replaces the present one.
struct SnapPart {
    std::size_t begin;
    SnapOutput output;
};

/// Puts the output of slabs that follow each other together. Uses the memory of the mesh of `all` again.
void join(const std::vector<const SnapOutput*>& slabs, SnapOutput& all);

/// Replaces slices, all at once. Points and triangles that follow are moved, and numbered again.
/// \pre the parts are in ascending order and have at least as many points and triangles as before
void replace_slices(SnapOutput& output, const std::vector<SnapPart>& parts);

}  // namespace marrow::internal
