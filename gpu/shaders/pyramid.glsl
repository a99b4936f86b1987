// Walks through a histogram pyramid whose nodes are the first outputs below them.
#ifndef MARROW_PYRAMID_GLSL
#define MARROW_PYRAMID_GLSL
#include "parameters.glsl"

uint leaf_at(uint pyramid, uint leaf) {
    return parameters.pyramids[pyramid].leaves.at[leaf / 4u] >> 8u * (leaf % 4u) & 255u;
}

// The first output below a node of level 1, which is the apex if there is no other.
uint first_of_node(uint pyramid, uint node) {
    return parameters.pyramids[pyramid].top == 1u ? 0u : parameters.pyramids[pyramid].nodes.at[node];
}

// Descends to the leaf that has the output `key`, and makes the key relative to the leaf.
uint descend(uint pyramid, inout uint key) {
    uint node = 0u;
    for (uint k = parameters.pyramids[pyramid].top - 1u; k >= 1u; --k) {
        const uint begin = parameters.pyramids[pyramid].begin[k];
        const uint first = 16u * node, end = min(first + 16u, parameters.pyramids[pyramid].size[k]);
        node = first;
        for (uint child = first + 1u; child < end; ++child) {
            if (parameters.pyramids[pyramid].nodes.at[begin + child] <= key) node = child;
        }
    }
    key -= first_of_node(pyramid, node);
    uint leaf = 16u * node;
    for (; leaf < 16u * node + 15u; ++leaf) {
        const uint outputs = leaf_at(pyramid, leaf);
        if (key < outputs) break;
        key -= outputs;
    }
    return leaf;
}

// The number of outputs before a leaf.
uint first_output(uint pyramid, uint leaf) {
    uint first = first_of_node(pyramid, leaf / 16u);
    for (uint sibling = leaf & ~15u; sibling < leaf; ++sibling) first += leaf_at(pyramid, sibling);
    return first;
}

#endif
