// Lists the devices that extract.
#include <marrow/gpu.h>

#include <pybind11/pybind11.h>

#include <vector>

#include "long_work.h"
#include "module.h"

namespace py = pybind11;

namespace marrow::python {

void add_devices(py::module_& module) {
    module.def("devices", [] {
        py::list list;
        const std::vector<gpu::Device> found =
            compute(py::none(), [](const Progress&) { return gpu::devices(); });
        for (const gpu::Device& device : found)
            list.append(py::make_tuple(device.name, gpu::device_kind_name(device.kind), device.driver,
                                       device.memory));
        return list;
    });
}

}  // namespace marrow::python
