/// Meshes between NumPy and Marrow.
#pragma once

#include <pybind11/numpy.h>

#include <memory>

#include <marrow/mesh.h>

namespace marrow::python {

/// A mesh whose arrays belong to NumPy.
class ArrayMesh {
  public:
    /// `points` is float32 (n, 3), `triangles` int32 or uint32 (m, 3), `normals` as
    /// `points` or None, all C-contiguous.
    /// \throw InputError other arrays
    ArrayMesh(const pybind11::object& points, const pybind11::object& triangles,
              const pybind11::object& normals);

    /// The arrays, which live as long as this object.
    const MeshView& view() const { return view_; }

  private:
    pybind11::object points_, triangles_, normals_;  // keep the memory alive
    MeshView view_;
};

/// A mesh as the tuple (points, triangles, normals) of C-contiguous, writable arrays, without a copy; each
/// keeps the whole mesh alive. Points and normals are float32, triangles int32, or uint32 where int32 cannot
/// number the points. `normals` is None for a mesh without normals.
pybind11::tuple to_python(const std::shared_ptr<Mesh>& mesh);
pybind11::tuple to_python(Mesh&& mesh);

}  // namespace marrow::python
