/// The marching cubes of scikit-image.
#pragma once

#include <pybind11/pybind11.h>

namespace marrow::python {

void add_scikit_image(pybind11::module_& module);

}  // namespace marrow::python
