#version 460
// Writes the triangles. One invocation descends the pyramid to its triangle, and counts the points before its three.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"
#include "pyramid.glsl"

// The index of the point on an edge of the cell at bit `bit` of word w. core/grid/cell.h numbers the edges.
uint point_on_edge(uint edge, int y, int z, int w, int bit) {
    if (edge >= 8u) {  // edge - 4 of the next cell
        edge -= 4u;
        if (++bit == 32) {
            bit = 0;
            ++w;
        }
    }
    const uint axis = edge < 4u ? 0u : edge < 6u ? 1u : 2u;
    if (axis != 1u) y += int(edge & 1u);
    if (axis == 0u) z += int(edge >> 1 & 1u);
    if (axis == 1u) z += int(edge & 1u);
    const uint row = uint(z) * uint(parameters.grid_rows[0]) + uint(y);
    return first_output(kPoints, point_leaf(row, axis, uint(w))) +
           uint(bitCount(crossed_edges(axis, y, z, w) & low_bits(bit)));
}

void write_triangle(uint triangle) {
    uint key = triangle;
    const uint leaf = descend(kTriangles, key);
    const uint row = leaf / parameters.leaf_words;
    const int w = int(leaf % parameters.leaf_words);
    const int y = int(row % uint(parameters.grid_rows[0])), z = int(row / uint(parameters.grid_rows[0]));
    uint here[4], after[4];
    [[unroll]] for (int r = 0; r < 4; ++r) {
        here[r] = bits_at(y + (r & 1), z + (r >> 1), w);
        after[r] = bits_at(y + (r & 1), z + (r >> 1), w + 1);
    }
    const CellBits cells = cell_bits(here, after);
    // The leaf has more than `key` triangles, so the loop ends at one of its active cells.
    uint left = active_cells(cells, w), cell_case = case_of(cells, findLSB(left));
    while (key >= triangles_of_case(cell_case)) {
        key -= triangles_of_case(cell_case);
        left &= left - 1u;
        cell_case = case_of(cells, findLSB(left));
    }
    const int bit = findLSB(left);
    uint points[3];
    [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        const uint corner = 3u * key + k;
        const uint edge = parameters.cases[2u * cell_case + corner / 8u] >> 4u * (corner % 8u) & 15u;
        points[k] = point_on_edge(edge, y, z, w, bit);
    }
    parameters.triangles.at[triangle] = Triple(points[0], points[1], points[2]);
}

void main() {
    const uint triangles = outputs_with_room(kTriangles);
    for (uint triangle = invocation(); triangle < triangles; triangle += invocations()) write_triangle(triangle);
}
