// The native module below the package `marrow`. It converts types and errors; the package is the public interface.
#include <pybind11/pybind11.h>

#include <marrow/version.h>

#include "errors.h"
#include "isosurface.h"
#include "scikit_image.h"
#include "volume.h"

PYBIND11_MODULE(_marrow, module) {
    marrow::python::add_errors(module);
    marrow::python::add_volume(module);
    marrow::python::add_isosurface(module);
    marrow::python::add_scikit_image(module);
    module.attr("__version__") = MARROW_VERSION;
}
