/// The functions of the native module, by topic. Each file of this folder adds its own.
#pragma once

#include <pybind11/pybind11.h>

namespace marrow::python {

void add_devices(pybind11::module_& module);
void add_filters(pybind11::module_& module);
void add_histogram(pybind11::module_& module);
void add_isosurface(pybind11::module_& module);
void add_labels(pybind11::module_& module);
void add_measure(pybind11::module_& module);
void add_mesh(pybind11::module_& module);
void add_mesh_files(pybind11::module_& module);
void add_label_parts(pybind11::module_& module);
void add_parts(pybind11::module_& module);
void add_refine(pybind11::module_& module);
void add_scan(pybind11::module_& module);
void add_scikit_image(pybind11::module_& module);
void add_streaming(pybind11::module_& module);
void add_thin_walls(pybind11::module_& module);
void add_trust(pybind11::module_& module);
void add_volume(pybind11::module_& module);

}  // namespace marrow::python
