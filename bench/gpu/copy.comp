#version 460
// Copies memory, 16 bytes an invocation: what the other kernels are compared with.
#extension GL_EXT_buffer_reference : require
layout(local_size_x = 256) in;
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Quads { uvec4 at[]; };
layout(push_constant) uniform Push { Quads from, to; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    to.at[i] = from.at[i];
}
