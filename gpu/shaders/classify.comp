#version 460
// Compares the samples of the listed blocks with the isovalue and writes inside bits. An invocation loads 16 bytes;
// 32 invocations in a row load one row of as many blocks as that takes, which mostly lie beside each other. Because the
// stored rows are padded to words of bits, samples and bits have the same order.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"
#include "grid.glsl"
#include "samples.glsl"

const uint kBlocks = kGroup / (kBlockRows * kLoads);  // blocks of a work group

shared uint parts[kGroup];  // the bits of each load

uint classify(int y, int z, uint w, uint load) {
    const uvec4 samples = slab_of(z).at[load_in_slab(y, z, w) + load];
    uint inside = 0u;
    [[unroll]] for (uint i = 0u; i < kPerLoad; ++i) {
        const int raw = extract_sample(samples[i / kPerWord], i % kPerWord);
        if (is_finite(raw) && ordered(raw) >= parameters.threshold) inside |= 1u << i;
    }
    return inside;
}

void main() {
    const uint listed = parameters.status.at[kListed];
    const uint lane = gl_LocalInvocationIndex % (kBlocks * kLoads);
    const uint row = gl_LocalInvocationIndex / (kBlocks * kLoads), load = lane % kLoads;
    for (uint begin = gl_WorkGroupID.x * kBlocks; begin < listed; begin += gl_NumWorkGroups.x * kBlocks) {
        const uint number = begin + lane / kLoads;
        uvec3 at = uvec3(0u);
        bool exists = false;
        uint inside = 0u;
        if (number < listed) {
            const uint block = parameters.list.at[number], state = state_of(block, parameters.threshold);
            at = block_at(block) + uvec3(0u, row, 0u);
            exists = at.y < uint(parameters.stored[1]);
            if (exists && state == kBoth) inside = classify(int(at.y), int(at.z), at.x, load);
            if (state == kAllInside) inside = low_bits(int(kPerLoad));
        }
        parts[gl_LocalInvocationIndex] = inside;
        barrier();
        if (exists && load == 0u) {
            uint word = 0u;
            for (uint part = 0u; part < kLoads; ++part)
                word |= parts[gl_LocalInvocationIndex + part] << part * kPerLoad;
            parameters.bits.at[(at.z * uint(parameters.stored[1]) + at.y) * parameters.row_words + at.x] =
                word & samples_in_view(int(at.y), int(at.z), int(at.x));
        }
        barrier();
    }
}
