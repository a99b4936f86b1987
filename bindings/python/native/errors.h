/// Marrow's exceptions in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <marrow/error.h>

namespace marrow::python {

/// There is no surface at the isovalue. In Python it also derives from RuntimeError,
/// which scikit-image raises then.
struct EmptySurface : InputError {
    using InputError::InputError;
};

/// Adds the exceptions to the module, and lets them stand for those of C++. Each also derives from the
/// built-in exception that Python's users would catch: InputError from ValueError, IoError from
/// OSError, LimitError from MemoryError.
void add_errors(pybind11::module_& module);

}  // namespace marrow::python
