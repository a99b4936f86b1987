#version 460
// Lists the blocks whose bits may differ from those that the threshold before gave: samples on both sides now, or all on
// another side than before.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"

shared uint listed, mixed;  // of this work group
shared uint first;          // its place in the list

void main() {
    for (uint begin = gl_WorkGroupID.x * kGroup; begin < block_count(); begin += invocations()) {
        if (gl_LocalInvocationIndex == 0u) {
            listed = 0u;
            mixed = 0u;
        }
        barrier();
        const uint block = begin + gl_LocalInvocationIndex;
        bool changes = false;
        uint place = 0u;
        if (block < block_count()) {
            const uint state = state_of(block, parameters.threshold);
            changes = state == kBoth || parameters.has_previous == 0u ||
                      state != state_of(block, parameters.previous_threshold);
            if (changes) place = atomicAdd(listed, 1u);
            if (state == kBoth) atomicAdd(mixed, 1u);
        }
        barrier();
        if (gl_LocalInvocationIndex == 0u && listed != 0u) {
            first = atomicAdd(parameters.status.at[kListed], listed);
            atomicAdd(parameters.status.at[kMixed], mixed);
        }
        barrier();
        if (changes) parameters.list.at[first + place] = block;
    }
}
