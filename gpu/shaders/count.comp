#version 460
// Counts the points and triangles of each word of each row of the grid: the leaves of the pyramids. One invocation
// counts for four words, because their counts share a word.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"

uint count_triangles(CellBits cells, int w) {
    uint triangles = 0u;
    for (uint left = active_cells(cells, w); left != 0u; left &= left - 1u)
        triangles += triangles_of_case(case_of(cells, findLSB(left)));
    return triangles;
}

// Writes four leaves, the first of which is `leaf`.
void write_leaves(uint pyramid, uint leaf, uint word) {
    parameters.pyramids[pyramid].leaves.at[leaf / 16u][leaf / 4u % 4u] = word;
}

void count(uint row, uint quad) {
    const int y = int(row % uint(parameters.grid_rows[0])), z = int(row / uint(parameters.grid_rows[0]));
    // At the end of the grid the row itself takes the place of the next one, so that no edge towards it is crossed.
    const int next_y = min(y + 1, parameters.grid_rows[0] - 1), next_z = min(z + 1, parameters.grid_rows[1] - 1);
    const int first = int(4u * quad);
    uint here[4], after[4];
    [[unroll]] for (int r = 0; r < 4; ++r) here[r] = bits_at((r & 1) == 0 ? y : next_y, r < 2 ? z : next_z, first);
    uint points[3] = uint[](0u, 0u, 0u), triangles = 0u;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        const int w = first + k;
        [[unroll]] for (int r = 0; r < 4; ++r)
            after[r] = bits_at((r & 1) == 0 ? y : next_y, r < 2 ? z : next_z, w + 1);
        const CellBits cells = cell_bits(here, after);
        const uint crossed[3] = uint[]((cells.corners[0] ^ cells.corners[1]) & cells_of_word(w), here[0] ^ here[1],
                                       here[0] ^ here[2]);
        [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) points[axis] |= uint(bitCount(crossed[axis])) << 8 * k;
        if (row_has_cells(y, z)) triangles |= count_triangles(cells, w) << 8 * k;
        here = after;
    }
    [[unroll]] for (uint axis = 0u; axis < 3u; ++axis)
        write_leaves(kPoints, point_leaf(row, axis, 4u * quad), points[axis]);
    write_leaves(kTriangles, triangle_leaf(row, 4u * quad), triangles);
}

void main() {
    const uint quads = parameters.leaf_words / 4u;
    const uint all = uint(parameters.grid_rows[0]) * uint(parameters.grid_rows[1]) * quads;
    for (uint i = invocation(); i < all; i += invocations()) count(i / quads, i % quads);
}
