// Walks through a histogram pyramid whose nodes are the first outputs below them.
#ifndef MARROW_PYRAMID_GLSL
#define MARROW_PYRAMID_GLSL
#include "bits.glsl"
#include "parameters.glsl"

// The 16 leaves of a node of level 1, a byte each.
uvec4 leaves_of(uint pyramid, uint node) {
    return parameters.pyramids[pyramid].leaves.at[node];
}

// The sum of the first n of 16 leaves.
uint sum_of_leaves(uvec4 leaves, uint n) {
    uint sum = 0u;
    [[unroll]] for (int k = 0; k < 4; ++k) sum += sum_of_bytes(leaves[k] & low_bits(8 * int(n) - 32 * k));
    return sum;
}

// The number of outputs, if there is memory for all of them, and otherwise 0. (The host then runs the kernel again.)
uint outputs_with_room(uint pyramid) {
    const uint apex = parameters.pyramids[pyramid].begin[parameters.pyramids[pyramid].top];
    const uint outputs = parameters.pyramids[pyramid].nodes.at[apex];
    return outputs <= parameters.room[pyramid] ? outputs : 0u;
}

// The first output below a node of level 1, which is the apex if there is no other.
uint first_of_node(uint pyramid, uint node) {
    return parameters.pyramids[pyramid].top == 1u ? 0u : parameters.pyramids[pyramid].nodes.at[node];
}

// Descends to the leaf that has the output `key`, and makes the key relative to the leaf.
uint descend(uint pyramid, inout uint key) {
    uint node = 0u;
    for (uint k = parameters.pyramids[pyramid].top - 1u; k >= 1u; --k) {
        const uint begin = parameters.pyramids[pyramid].begin[k], size = parameters.pyramids[pyramid].size[k];
        node *= 16u;
        // The last child that begins at or before the output.
        [[unroll]] for (uint step = 8u; step >= 1u; step >>= 1) {
            const uint child = node + step;
            if (child < size && parameters.pyramids[pyramid].nodes.at[begin + child] <= key) node = child;
        }
    }
    key -= first_of_node(pyramid, node);
    const uvec4 leaves = leaves_of(pyramid, node);
    uint word = 0u, outputs = sum_of_bytes(leaves.x);
    while (word < 3u && key >= outputs) {
        key -= outputs;
        outputs = sum_of_bytes(leaves[++word]);
    }
    uint leaf = 0u;
    while (leaf < 3u && key >= (leaves[word] >> 8u * leaf & 255u)) {
        key -= leaves[word] >> 8u * leaf & 255u;
        ++leaf;
    }
    return 16u * node + 4u * word + leaf;
}

// The number of outputs before a leaf.
uint first_output(uint pyramid, uint leaf) {
    return first_of_node(pyramid, leaf / 16u) + sum_of_leaves(leaves_of(pyramid, leaf / 16u), leaf % 16u);
}

#endif
