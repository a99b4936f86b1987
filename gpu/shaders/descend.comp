#version 460
// Turns the children of a level's nodes from numbers of outputs into first outputs. The level itself has been turned
// before, except the apex, which stays what it is.
#extension GL_GOOGLE_include_directive : require
#include "parameters.glsl"

void turn_children(uint node) {
    Words nodes = parameters.pyramids[which].nodes;
    const uint begin = parameters.pyramids[which].begin[level - 1u];
    const uint end = min(16u * node + 16u, parameters.pyramids[which].size[level - 1u]);
    uint first = level == parameters.pyramids[which].top
                     ? 0u
                     : nodes.at[parameters.pyramids[which].begin[level] + node];
    for (uint child = 16u * node; child < end; ++child) {
        const uint outputs = nodes.at[begin + child];
        nodes.at[begin + child] = first;
        first += outputs;
    }
}

void main() {
    for (uint node = invocation(); node < parameters.pyramids[which].size[level]; node += invocations())
        turn_children(node);
}
