// The grid of cells over the inside bits: 32 bits a word. The layer of outside samples around a closed volume is not
// stored: the grid begins one row and one slice before the view, and one word before the stored rows, and what is
// not in the view reads as zeros.
#ifndef MARROW_GRID_GLSL
#define MARROW_GRID_GLSL
#include "bits.glsl"
#include "parameters.glsl"

const int kPad = kClosed ? 1 : 0;

uint bits_at(int y, int z, int w) {
    y -= kPad;
    z -= kPad;
    w -= kPad;
    if (kClosed && (y < 0 || z < 0 || y >= parameters.dims[1] || z >= parameters.dims[2] || w < 0)) return 0u;
    if (w >= int(parameters.row_words)) return 0u;
    const uint row = uint(z + parameters.lead[2]) * uint(parameters.stored[1]) + uint(y + parameters.lead[1]);
    return parameters.bits.at[row * parameters.row_words + uint(w)];
}

// For each sample of word w, the next sample along x.
uint next_bits_at(int y, int z, int w) {
    return bits_at(y, z, w) >> 1 | bits_at(y, z, w + 1) << 31;
}

// The samples of word w of a stored row that are in the view.
uint samples_in_view(int y, int z, int w) {
    y -= parameters.lead[1];
    z -= parameters.lead[2];
    if (y < 0 || z < 0 || y >= parameters.dims[1] || z >= parameters.dims[2]) return 0u;
    const int x = 32 * w - parameters.lead[0];
    return low_bits(parameters.dims[0] - x) & ~low_bits(-x);
}

// The index in the view of bit 0 of word w.
int x_of_word(int w) {
    return 32 * (w - kPad) - parameters.lead[0];
}

// The bits of word w at which cells, and edges along x, start.
uint cells_of_word(int w) {
    const int x = x_of_word(w);
    return low_bits(parameters.dims[0] - 1 + kPad - x) & ~low_bits(-kPad - x);
}

// The edges along an axis that start in word w of a row and are crossed. At the end of the grid the row itself takes
// the place of the next one, so that no edge towards it is crossed.
uint crossed_edges(uint axis, int y, int z, int w) {
    const uint here = bits_at(y, z, w);
    if (axis == 0u) return (here ^ next_bits_at(y, z, w)) & cells_of_word(w);
    if (axis == 1u) return here ^ bits_at(min(y + 1, parameters.grid_rows[0] - 1), z, w);
    return here ^ bits_at(y, min(z + 1, parameters.grid_rows[1] - 1), w);
}

bool row_has_cells(int y, int z) {
    return y + 1 < parameters.grid_rows[0] && z + 1 < parameters.grid_rows[1];
}

// The samples around the 32 cells of a word: bit i of corner v is corner v of cell i.
struct CellBits {
    uint corners[8];
};

// Row r is at y + (r & 1), z + (r >> 1): its word w, and the word after it.
CellBits cell_bits(uint here[4], uint after[4]) {
    CellBits cells;
    [[unroll]] for (int r = 0; r < 4; ++r) {
        cells.corners[2 * r] = here[r];
        cells.corners[2 * r + 1] = here[r] >> 1 | after[r] << 31;
    }
    return cells;
}

// The cells that the surface crosses.
uint active_cells(CellBits cells, int w) {
    uint some = 0u, all = ~0u;
    [[unroll]] for (int v = 0; v < 8; ++v) {
        some |= cells.corners[v];
        all &= cells.corners[v];
    }
    return some & ~all & cells_of_word(w);
}

uint case_of(CellBits cells, int bit) {
    uint cell_case = 0u;
    [[unroll]] for (int v = 0; v < 8; ++v) cell_case |= (cells.corners[v] >> bit & 1u) << v;
    return cell_case;
}

uint triangles_of_case(uint cell_case) {
    return parameters.cases[2u * cell_case + 1u] >> 28;
}

// Points are ordered by row, then by the axis of their edge, then by x. So the leaves of their pyramid are the words
// of a row for each axis; those of the triangles' pyramid are the words of a row. Four leaves share a word.
uint point_leaf(uint row, uint axis, uint w) {
    return (3u * row + axis) * parameters.leaf_words + w;
}
uint triangle_leaf(uint row, uint w) {
    return row * parameters.leaf_words + w;
}

#endif
