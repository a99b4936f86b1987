// The native module below the package `marrow`. It converts types and errors; the
// package is the public interface.
#include "module.h"

#include <marrow/version.h>

#include "errors.h"
#include "long_work.h"

PYBIND11_MODULE(_marrow, module) {
    using namespace marrow::python;
    module.attr("__version__") = MARROW_VERSION;
    add_errors(module);
    stop_long_work_at_exit();
    add_volume(module);
    add_mesh(module);
    add_devices(module);
    add_isosurface(module);
    add_filters(module);
    add_histogram(module);
    add_labels(module);
    add_label_parts(module);
    add_measure(module);
    add_mesh_files(module);
    add_parts(module);
    add_refine(module);
    add_scan(module);
    add_scikit_image(module);
    add_streaming(module);
    add_thin_walls(module);
    add_trust(module);
}
