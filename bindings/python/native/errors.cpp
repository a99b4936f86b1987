#include "errors.h"

#include <array>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include <marrow/gpu.h>

#include "text.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

// They live as long as the interpreter.
PyObject* error_type = nullptr;
PyObject* input_error = nullptr;
PyObject* geometry_error = nullptr;
PyObject* io_error = nullptr;
PyObject* limit_error = nullptr;
PyObject* cancelled = nullptr;
PyObject* empty_surface = nullptr;
PyObject* device_error = nullptr;

PyObject* add(py::module_& module, const char* name, const char* doc, const py::tuple& bases) {
    const std::string full_name = std::string("marrow.") + name;
    PyObject* type = PyErr_NewExceptionWithDoc(full_name.c_str(), doc, bases.ptr(), nullptr);
    if (type == nullptr) throw py::error_already_set();
    module.attr(name) = py::handle(type);
    return type;
}

// The library's messages name options and functions of C++.
std::string with_names_of_python(std::string message) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kNames{
        {{"limits.memory", "max_memory"}, {"inspect_scan", "marrow.inspect"}, {"options.", ""}}};
    for (const auto& [cpp, python] : kNames) {
        for (std::size_t at = message.find(cpp); at != message.npos; at = message.find(cpp, at)) {
            // Not within the name of a file, nor the last word of a sentence.
            const bool begins = at == 0 || message[at - 1] == ' ';
            const bool goes_on =
                cpp.back() != '.' || std::isalpha(static_cast<unsigned char>(message[at + cpp.size()]));
            const bool is_name = begins && goes_on;
            if (is_name) message.replace(at, cpp.size(), python);
            at += is_name ? python.size() : cpp.size();
        }
    }
    return message;
}

// Raises an error, also if a word of a file in its message is not UTF-8.
void raise(PyObject* type, const std::exception& error) {
    PyErr_SetObject(type, readable(with_names_of_python(error.what())).ptr());
}

void translate(std::exception_ptr exception) {
    try {
        if (exception) std::rethrow_exception(exception);
    } catch (const EmptySurface& e) {
        raise(empty_surface, e);
    } catch (const GeometryError& e) {
        raise(geometry_error, e);
    } catch (const InputError& e) {
        raise(input_error, e);
    } catch (const IoError& e) {
        raise(io_error, e);
    } catch (const LimitError& e) {
        raise(limit_error, e);
    } catch (const Cancelled& e) {
        raise(cancelled, e);
    } catch (const gpu::DeviceError& e) {
        raise(device_error, e);
    } catch (const Error& e) {
        raise(error_type, e);
    }
}

py::tuple bases(PyObject* first, PyObject* second) {
    return py::make_tuple(py::handle(first), py::handle(second));
}

}  // namespace

void add_errors(py::module_& module) {
    error_type = add(module, "Error", "The base of all errors that Marrow raises.",
                     py::make_tuple(py::handle(PyExc_Exception)));
    input_error =
        add(module, "InputError", "A bad argument, or a file whose content is damaged or not supported.",
            bases(error_type, PyExc_ValueError));
    geometry_error =
        add(module, "GeometryError", "The geometry of the input is ambiguous or would distort the result.",
            py::make_tuple(py::handle(input_error)));
    io_error = add(module, "IoError", "The operating system refused: missing file, no permission, full disk.",
                   bases(error_type, PyExc_OSError));
    limit_error = add(module, "LimitError", "An input or a result that is too large.",
                      bases(error_type, PyExc_MemoryError));
    cancelled = add(module, "Cancelled", "The progress callback returned False, which stops the work.",
                    py::make_tuple(py::handle(error_type)));
    empty_surface =
        add(module, "EmptySurface", "There is no surface: all samples are on one side of the isovalue.",
            bases(input_error, PyExc_RuntimeError));
    device_error = add(module, "DeviceError", "There is no such device to extract on.",
                       bases(error_type, PyExc_RuntimeError));
    py::register_exception_translator(translate);
}

}  // namespace marrow::python
