#version 460
// Compares samples with the isovalue and writes inside bits. One invocation writes a word. Because the stored rows
// are padded to words of bits, samples and bits have the same order. Samples are read only in blocks that the surface
// may cross, and bits are written only where they can change.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"
#include "grid.glsl"
#include "samples.glsl"

uint classify(int y, int z, uint w) {
    Words slab = slab_of(z);
    const uint first = row_in_slab(y, z) + w * kSampleBits;
    uint inside = 0u;
    for (uint j = 0u; j < kSampleBits; ++j) {
        const uint samples = slab.at[first + j];
        [[unroll]] for (uint k = 0u; k < kPerWord; ++k) {
            const int raw = extract_sample(samples, k);
            if (is_finite(raw) && ordered(raw) >= parameters.threshold) inside |= 1u << j * kPerWord + k;
        }
    }
    return inside;
}

void main() {
    const uint word = invocation();
    const uint w = word % parameters.row_words, row = word / parameters.row_words;
    const uint y = row % uint(parameters.stored[1]), z = row / uint(parameters.stored[1]);
    if (z >= uint(parameters.stored[2])) return;
    const uint block = block_of(w, y, z), state = state_of(block, parameters.threshold);
    if (state != kMixed && parameters.has_previous != 0u && state == state_of(block, parameters.previous_threshold))
        return;
    const uint inside = state == kMixed ? classify(int(y), int(z), w) : state == kInside ? ~0u : 0u;
    parameters.bits.at[word] = inside & samples_in_view(int(y), int(z), int(w));
}
