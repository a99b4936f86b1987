// The range of the samples in each block, which is a word of kBlockRows rows of a slice. A changed isovalue reads only
// the blocks whose range holds it.
#ifndef MARROW_BLOCKS_GLSL
#define MARROW_BLOCKS_GLSL
#include "parameters.glsl"

const uint kBlockRows = 8u;

uint block_rows() {
    return (uint(parameters.stored[1]) + kBlockRows - 1u) / kBlockRows;
}

uint block_of(uint w, uint y, uint z) {
    return (z * block_rows() + y / kBlockRows) * parameters.row_words + w;
}

const uint kOutside = 0u, kInside = 1u, kMixed = 2u;

// Whether all samples of a block are outside, or inside, at a threshold.
uint state_of(uint block, int threshold) {
    const int least = int(parameters.ranges.at[2u * block]), greatest = int(parameters.ranges.at[2u * block + 1u]);
    return greatest < threshold ? kOutside : least >= threshold ? kInside : kMixed;
}

#endif
