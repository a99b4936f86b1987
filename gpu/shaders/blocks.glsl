// The range of the samples in each block, which is a word of kBlockRows rows of a slice. A changed isovalue reads only
// the blocks whose range holds it.
#ifndef MARROW_BLOCKS_GLSL
#define MARROW_BLOCKS_GLSL
#include "parameters.glsl"

const uint kBlockRows = 8u;

// Rows of blocks in a slice.
uint block_rows() {
    return (uint(parameters.stored[1]) + kBlockRows - 1u) / kBlockRows;
}

uint block_count() {
    return parameters.row_words * block_rows() * uint(parameters.stored[2]);
}

// Where a block begins: the word of its rows, the first row, and the slice.
uvec3 block_at(uint block) {
    const uint row = block / parameters.row_words;
    return uvec3(block % parameters.row_words, row % block_rows() * kBlockRows, row / block_rows());
}

// Whether all samples of a block are outside, or inside, at a threshold.
const uint kAllOutside = 0u, kAllInside = 1u, kBoth = 2u;

uint state_of(uint block, int threshold) {
    const int least = int(parameters.ranges.at[2u * block]), greatest = int(parameters.ranges.at[2u * block + 1u]);
    return greatest < threshold ? kAllOutside : least >= threshold ? kAllInside : kBoth;
}

#endif
