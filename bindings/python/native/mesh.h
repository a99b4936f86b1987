/// Meshes between NumPy and Marrow.
#pragma once

#include <pybind11/numpy.h>

#include <marrow/mesh.h>

namespace marrow::python {

/// A mesh as the tuple (points, triangles, normals) of C-contiguous, writable arrays that take its memory over; each keeps
/// the whole mesh alive. Points and normals are float32, triangles int32, or uint32 where int32 cannot number the points.
/// `normals` is None without normals.
pybind11::tuple to_python(Mesh&& mesh);

}  // namespace marrow::python
