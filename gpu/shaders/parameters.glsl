// What every kernel gets: the address of one block of parameters. gpu/parameters.h declares the same in C++.
#ifndef MARROW_PARAMETERS_GLSL
#define MARROW_PARAMETERS_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_control_flow_attributes : require

// The constants that a pipeline is made for.
const int kUint8 = 0, kInt8 = 1, kUint16 = 2, kInt16 = 3, kFloat32 = 5;  // values of SampleType
layout(constant_id = 0) const int kSampleType = kInt16;
layout(constant_id = 1) const bool kClosed = false;
layout(constant_id = 2) const bool kNormals = true;

const uint kGroup = 256u;
layout(local_size_x = 256) in;

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Quads { uvec4 at[]; };  // four words
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Floats { float at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Slabs { Quads at[]; };
struct Triple {
    uint x, y, z;
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Triples { Triple at[]; };

// A histogram pyramid: every node of level k > 0 has up to 16 children in level k - 1, and the apex is level `top`.
// After reduction a node is the sum of its children, after descent the first output below it; the apex stays the
// number of outputs.
struct Pyramid {
    Quads leaves;   // level 0: a byte each
    Words nodes;    // the levels above, one after the other
    uint size[9];   // of each level
    uint begin[9];  // of each level in `nodes`
    uint top;
};
const uint kPoints = 0, kTriangles = 1;  // the two pyramids

// Words of `status`.
const uint kNotFinite = 0u;  // samples that are not finite: the lower word, and the upper one after it
const uint kUnsafe = 2u;     // whether a result may have other bits than the CPU's
const uint kListed = 3u;     // blocks in the list
const uint kMixed = 4u;      // blocks in it whose samples are read

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Parameters {
    Slabs slabs;       // the samples, whole slices in each; rows are padded to words of bits
    Words ranges;      // of the blocks of samples, two words each
    Words list;        // of the blocks whose bits may change
    Words bits;        // an inside bit for each sample, 0 outside the view
    Floats row_bases;  // of the grid's rows, three each
    Words status;
    Triples points, normals, triangles;  // the output
    Pyramid pyramids[2];
    int dims[3];    // samples of the view
    int stored[3];  // samples on the device: the view, and those beyond it that normals need
    int lead[3];    // stored samples before the view
    int grid_rows[2];  // rows along y and z, those around a closed volume included
    int first_x;    // index in the whole volume of the view's first sample
    uint row_words;   // words of bits in a stored row
    uint leaf_words;  // words of bits in a row of the grid, rounded up to four
    uint slab_slices;
    int threshold;    // the least sample that is inside, as ordered() maps it
    int previous_threshold;  // the one that the bits are of
    uint has_previous;
    uint room[2];  // outputs of each pyramid that there is memory for; nothing is written if there are more
    float half_isovalue;
    float matrix[9], normal_matrix[9], axis[9];  // as IndexToPhysical, by rows; row a of `axis` is index axis a
    uint cases[512];  // two words a case: 15 edges of 4 bits, and the number of triangles
};

layout(push_constant) uniform Push {
    Parameters parameters;
    uint which;  // the pyramid
    uint level;
};

// Elements are shared out among all invocations: each takes number invocation(), and then every invocations()-th.
uint invocation() {
    return gl_GlobalInvocationID.x;
}
uint invocations() {
    return gl_NumWorkGroups.x * kGroup;
}

#endif
