#version 460
// The points and normals on devices that let a shader say how floats are rounded: to nearest even (RoundingModeRTE), and
// with the signs of zeros (SignedZeroInfNanPreserve).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_spirv_intrinsics : require
spirv_execution_mode(capabilities = [4467], 4462, 32);
spirv_execution_mode(capabilities = [4466], 4461, 32);
#include "points.glsl"
