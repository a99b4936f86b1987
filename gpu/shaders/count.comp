#version 460
// Counts the points and triangles of each word of each row of the grid: the leaves of the pyramids. One invocation
// counts for four words, because their counts share a word.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"

uint count_triangles(int y, int z, int w) {
    const CellBits cells = cell_bits(y, z, w);
    uint triangles = 0u;
    for (uint left = active_cells(cells, w); left != 0u; left &= left - 1u)
        triangles += triangles_of_case(case_of(cells, findLSB(left)));
    return triangles;
}

void main() {
    const uint quads = parameters.leaf_words / 4u;
    const uint row = invocation() / quads, quad = invocation() % quads;
    if (row >= uint(parameters.grid_rows[0]) * uint(parameters.grid_rows[1])) return;
    const int y = int(row % uint(parameters.grid_rows[0])), z = int(row / uint(parameters.grid_rows[0]));
    uint points[3] = uint[](0u, 0u, 0u), triangles = 0u;
    for (int k = 0; k < 4; ++k) {
        const int w = int(4u * quad) + k;
        [[unroll]] for (uint axis = 0u; axis < 3u; ++axis)
            points[axis] |= uint(bitCount(crossed_edges(axis, y, z, w))) << 8 * k;
        if (row_has_cells(y, z)) triangles |= count_triangles(y, z, w) << 8 * k;
    }
    [[unroll]] for (uint axis = 0u; axis < 3u; ++axis)
        parameters.pyramids[kPoints].leaves.at[point_leaf(row, axis, 4u * quad) / 4u] = points[axis];
    parameters.pyramids[kTriangles].leaves.at[triangle_leaf(row, 4u * quad) / 4u] = triangles;
}
