/// Text of files in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

namespace marrow::python {

/// Text as a str. Files and their names can hold bytes that are not UTF-8: each becomes U+FFFD.
inline pybind11::str readable(const std::string& text) {
    PyObject* const decoded =
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace");
    if (decoded == nullptr) throw pybind11::error_already_set();
    return pybind11::reinterpret_steal<pybind11::str>(decoded);
}

/// Texts as a tuple of str.
inline pybind11::tuple readable(const std::vector<std::string>& texts) {
    pybind11::list all;
    for (const std::string& text : texts) all.append(readable(text));
    return pybind11::tuple(all);
}

}  // namespace marrow::python
