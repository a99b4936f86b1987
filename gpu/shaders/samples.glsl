// Reads samples of any type from 32-bit words.
#ifndef MARROW_SAMPLES_GLSL
#define MARROW_SAMPLES_GLSL
#include "parameters.glsl"

const uint kSampleBits = kSampleType == kFloat32 ? 32u : kSampleType == kInt16 || kSampleType == kUint16 ? 16u : 8u;
const uint kPerWord = 32u / kSampleBits;
// Invocations load 16 bytes at once.
const uint kPerLoad = 128u / kSampleBits;    // samples of a load
const uint kLoads = kSampleBits / 4u;        // loads of the 32 samples of a word of bits

// Sample k of a word, or the bits of a float.
int extract_sample(uint word, uint k) {
    const int offset = int(k * kSampleBits);
    if (kSampleType == kInt8 || kSampleType == kInt16) return bitfieldExtract(int(word), offset, int(kSampleBits));
    if (kSampleType == kFloat32) return int(word);
    return int(bitfieldExtract(word, offset, int(kSampleBits)));
}

// The index in its slab of a stored row, in rows.
uint row_in_slab(int y, int z) {
    return uint(z) % parameters.slab_slices * uint(parameters.stored[1]) + uint(y);
}

// The index in its slab of the first 16 bytes of word w of a stored row.
uint load_in_slab(int y, int z, uint w) {
    return (row_in_slab(y, z) * parameters.row_words + w) * kLoads;
}

Quads slab_of(int z) {
    return parameters.slabs.at[uint(z) / parameters.slab_slices];
}

// The stored sample at an index.
int sample_at(ivec3 at) {
    const uint word = row_in_slab(at.y, at.z) * parameters.row_words * kSampleBits + uint(at.x) / kPerWord;
    return extract_sample(slab_of(at.z).at[word / 4u][word % 4u], uint(at.x) % kPerWord);
}

bool is_finite(int raw) {
    return kSampleType != kFloat32 || (raw & 0x7f800000) != 0x7f800000;
}

// Maps the bits of floats to integers in the same order, so that denormals are compared too. -0 comes before +0.
int ordered(int raw) {
    return kSampleType == kFloat32 ? raw ^ (raw >> 31 & 0x7fffffff) : raw;
}

float value_of(int raw) {
    return kSampleType == kFloat32 ? intBitsToFloat(raw) : float(raw);
}

#endif
