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

layout(local_size_x = 256) in;

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Floats { float at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Slabs { Words at[]; };
struct Triple {
    uint x, y, z;
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer Triples { Triple at[]; };

// A histogram pyramid: every node of level k > 0 has up to 16 children in level k - 1, and the apex is level `top`.
// After reduction a node is the sum of its children, after descent the first output below it; the apex stays the
// number of outputs.
struct Pyramid {
    Words leaves;   // level 0: a byte each
    Words nodes;    // the levels above, one after the other
    uint size[9];   // of each level
    uint begin[9];  // of each level in `nodes`
    uint top;
};
const uint kPoints = 0, kTriangles = 1;  // the two pyramids

layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Parameters {
    Slabs slabs;       // the samples, whole slices in each; rows are padded to words of bits
    Words ranges;      // of the blocks of samples, two words each
    Words bits;        // an inside bit for each sample, 0 outside the view
    Floats row_bases;  // of the grid's rows, three each
    Words cases;       // two words a case: 15 edges of 4 bits, and the number of triangles
    Words status;      // [0] samples that are not finite, [1] whether a result may have other bits than the CPU's
    Triples points, normals, triangles;
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
    float half_isovalue;
    float matrix[9], normal_matrix[9], axis[9];  // as IndexToPhysical, by rows; row a of `axis` is index axis a
};

layout(push_constant) uniform Push {
    Parameters parameters;
    uint which;  // the pyramid
    uint level;
};

// The number of this invocation in the whole dispatch, which is two-dimensional because an axis has 65535 groups.
uint invocation() {
    return gl_GlobalInvocationID.y * (gl_NumWorkGroups.x * gl_WorkGroupSize.x) + gl_GlobalInvocationID.x;
}

#endif
