#version 460
// The points and normals on any device. Nothing says how it rounds, but all that are known round to nearest even.
#extension GL_GOOGLE_include_directive : require
#include "points.glsl"
