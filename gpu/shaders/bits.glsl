// Small functions on the bits and bytes of words.
#ifndef MARROW_BITS_GLSL
#define MARROW_BITS_GLSL
#extension GL_EXT_control_flow_attributes : require

// The lowest n bits, for any n.
uint low_bits(int n) {
    return n <= 0 ? 0u : n >= 32 ? ~0u : (1u << n) - 1u;
}

// The position of bit number k, counted from 0, among the bits that are set.
int find_bit(uint bits, uint k) {
    int position = 0;
    [[unroll]] for (int width = 16; width >= 1; width >>= 1) {
        const uint below = uint(bitCount(bits >> position & low_bits(width)));
        if (k >= below) {
            k -= below;
            position += width;
        }
    }
    return position;
}

uint sum_of_bytes(uint word) {
    const uint pairs = (word & 0x00ff00ffu) + (word >> 8 & 0x00ff00ffu);
    return (pairs & 0xffffu) + (pairs >> 16);
}

#endif
