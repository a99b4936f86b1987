#version 460
// Finds the range of each block, as ordered() maps its samples, and counts the samples that are not finite. A block that
// has one is never all inside.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"
#include "grid.glsl"
#include "samples.glsl"

const int kLeast = -0x7fffffff - 1, kGreatest = 0x7fffffff;

void find_range(uint block) {
    const uvec3 at = block_at(block);
    const int z = int(at.z), end = min(int(at.y + kBlockRows), parameters.stored[1]);
    int least = kGreatest, greatest = kLeast;
    uint not_finite = 0u;
    Quads slab = slab_of(z);
    for (int y = int(at.y); y < end; ++y) {
        const uint in_view = samples_in_view(y, z, int(at.x));
        for (uint load = 0u; load < kLoads; ++load) {
            const uvec4 samples = slab.at[load_in_slab(y, z, at.x) + load];
            [[unroll]] for (uint i = 0u; i < kPerLoad; ++i) {
                if ((in_view >> load * kPerLoad + i & 1u) == 0u) continue;
                const int raw = extract_sample(samples[i / kPerWord], i % kPerWord);
                if (is_finite(raw)) {
                    least = min(least, ordered(raw));
                    greatest = max(greatest, ordered(raw));
                } else {
                    ++not_finite;
                }
            }
        }
    }
    if (not_finite != 0u) {
        const uint before = atomicAdd(parameters.status.at[kNotFinite], not_finite);
        if (before + not_finite < before) atomicAdd(parameters.status.at[kNotFinite + 1u], 1u);
    }
    parameters.ranges.at[2u * block] = uint(not_finite != 0u ? kLeast : least);
    parameters.ranges.at[2u * block + 1u] = uint(greatest);
}

void main() {
    for (uint block = invocation(); block < block_count(); block += invocations()) find_range(block);
}
