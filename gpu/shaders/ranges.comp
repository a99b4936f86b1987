#version 460
// Finds the range of each block, as ordered() maps its samples, and counts the samples that are not finite. A block that
// has one is never all inside.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"
#include "grid.glsl"
#include "samples.glsl"

const int kLeast = -0x7fffffff - 1, kGreatest = 0x7fffffff;

void main() {
    const uint block = invocation();
    const uint w = block % parameters.row_words, row = block / parameters.row_words;
    const int z = int(row / block_rows());
    if (z >= parameters.stored[2]) return;
    const int first = int(row % block_rows() * kBlockRows);
    const int end = min(first + int(kBlockRows), parameters.stored[1]);
    int least = kGreatest, greatest = kLeast;
    uint not_finite = 0u;
    Words slab = slab_of(z);
    for (int y = first; y < end; ++y) {
        const uint in_view = samples_in_view(y, z, int(w));
        const uint begin = row_in_slab(y, z) + w * kSampleBits;
        for (uint i = 0u; i < 32u; ++i) {
            if ((in_view >> i & 1u) == 0u) continue;
            const int raw = extract_sample(slab.at[begin + i / kPerWord], i % kPerWord);
            if (is_finite(raw)) {
                least = min(least, ordered(raw));
                greatest = max(greatest, ordered(raw));
            } else {
                ++not_finite;
            }
        }
    }
    if (not_finite != 0u) atomicAdd(parameters.status.at[0], not_finite);
    parameters.ranges.at[2u * block] = uint(not_finite != 0u ? kLeast : least);
    parameters.ranges.at[2u * block + 1u] = uint(greatest);
}
