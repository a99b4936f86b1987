#version 460
// Builds a level of a histogram pyramid from the one below: each node is the sum of its children. A sum that does
// not fit becomes the greatest number, and so do those above it.
#extension GL_GOOGLE_include_directive : require
#include "pyramid.glsl"

void main() {
    const uint node = invocation();
    if (node >= parameters.pyramids[which].size[level]) return;
    const uint end = min(16u * node + 16u, parameters.pyramids[which].size[level - 1u]);
    uint sum = 0u;
    for (uint child = 16u * node; child < end; ++child) {
        const uint outputs = level == 1u ? leaf_at(which, child)
                                         : parameters.pyramids[which].nodes.at
                                               [parameters.pyramids[which].begin[level - 1u] + child];
        sum = sum > ~0u - outputs ? ~0u : sum + outputs;
    }
    parameters.pyramids[which].nodes.at[parameters.pyramids[which].begin[level] + node] = sum;
}
