#version 460
// Compares samples with the isovalue and writes inside bits. One invocation writes a word. Because the stored rows
// are padded to words of bits, samples and bits have the same order.
#extension GL_GOOGLE_include_directive : require
#include "grid.glsl"
#include "samples.glsl"

void main() {
    const uint word = invocation();
    const uint rows = uint(parameters.stored[1]) * uint(parameters.stored[2]);
    if (word / parameters.row_words >= rows) return;
    const uint row = word / parameters.row_words, w = word % parameters.row_words;
    const int y = int(row % uint(parameters.stored[1])), z = int(row / uint(parameters.stored[1]));
    const int view_y = y - parameters.lead[1], view_z = z - parameters.lead[2];
    uint inside = 0u, not_finite = 0u;
    if (view_y >= 0 && view_y < parameters.dims[1] && view_z >= 0 && view_z < parameters.dims[2]) {
        Words slab = slab_of(z);
        const uint first = row_in_slab(y, z) + w * kSampleBits;
        for (uint j = 0u; j < kSampleBits; ++j) {
            const uint samples = slab.at[first + j];
            [[unroll]] for (uint k = 0u; k < kPerWord; ++k) {
                const int raw = extract_sample(samples, k);
                const uint bit = 1u << j * kPerWord + k;
                if (!is_finite(raw))
                    not_finite |= bit;
                else if (ordered(raw) >= parameters.threshold)
                    inside |= bit;
            }
        }
        const int x = 32 * int(w) - parameters.lead[0];
        const uint in_view = low_bits(parameters.dims[0] - x) & ~low_bits(-x);
        inside &= in_view;
        not_finite &= in_view;
    }
    parameters.bits.at[word] = inside;
    if (not_finite != 0u) atomicAdd(parameters.status.at[0], uint(bitCount(not_finite)));
}
