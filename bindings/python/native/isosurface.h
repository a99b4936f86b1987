/// Isosurfaces of arrays.
#pragma once

#include <pybind11/pybind11.h>

namespace marrow::python {

void add_isosurface(pybind11::module_& module);

}  // namespace marrow::python
