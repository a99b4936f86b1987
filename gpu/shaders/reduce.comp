#version 460
// Builds a level of a histogram pyramid from the one below: each node is the sum of its children. A sum that does
// not fit becomes the greatest number, and so do those above it.
#extension GL_GOOGLE_include_directive : require
#include "pyramid.glsl"

uint sum_of_children(uint node) {
    const uint children = min(16u, parameters.pyramids[which].size[level - 1u] - 16u * node);
    if (level == 1u) return sum_of_leaves(leaves_of(which, node), children);
    const uint first = parameters.pyramids[which].begin[level - 1u] + 16u * node;
    uint sum = 0u;
    for (uint child = first; child < first + children; ++child) {
        const uint outputs = parameters.pyramids[which].nodes.at[child];
        sum = sum > ~0u - outputs ? ~0u : sum + outputs;
    }
    return sum;
}

void main() {
    for (uint node = invocation(); node < parameters.pyramids[which].size[level]; node += invocations())
        parameters.pyramids[which].nodes.at[parameters.pyramids[which].begin[level] + node] = sum_of_children(node);
}
