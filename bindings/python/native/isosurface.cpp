// Isosurfaces of arrays.
#include <marrow/isosurface.h>

#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <marrow/gpu.h>
#include <marrow/tissue_presets.h>

#include "long_work.h"
#include "mesh.h"
#include "module.h"
#include "volume.h"

namespace py = pybind11;

namespace marrow::python {

namespace {

py::tuple extract(const ArrayVolume& volume, double isovalue, bool closed, bool normals, double snap,
                  bool topology, int threads, const py::object& progress) {
    return to_python(compute(progress, [&](const Progress& report) {
        return extract_isosurface(volume.view(), isovalue,
                                  {.normals = normals,
                                   .closed = closed,
                                   .snap = snap,
                                   .topology = topology,
                                   .threads = threads,
                                   .progress = report});
    }));
}

// An extractor that several Python threads may use, one after the other. It keeps the array alive. `device`
// is as gpu::choose_device() takes it.
class ArrayExtractor {
  public:
    ArrayExtractor(const ArrayVolume& volume, bool closed, bool normals, double snap, bool topology,
                   int threads, const std::string& device)
        : volume_(volume), extractor_(compute(py::none(), [&](const Progress& progress) {
              const std::optional<std::size_t> number = gpu::choose_device(device);
              if (number) device_name_ = gpu::devices().at(*number).name;
              report_ = progress;
              return gpu::FallbackExtractor(
                  volume_.view(),
                  {.normals = normals,
                   .closed = closed,
                   .snap = snap,
                   .topology = topology,
                   .threads = threads,
                   .progress = [this](double fraction) { return report_(fraction); }},
                  number);
          })) {
        note_failure();
    }

    py::tuple extract(double isovalue, int level, const py::object& progress) {
        return to_python(compute(progress, [&](const Progress& report) {
            const std::unique_lock turn = wait_for_turn(report);
            report_ = report;
            const std::shared_ptr<Mesh> mesh = unused_mesh();
            extractor_.extract(isovalue, *mesh, level);
            note_failure();
            return mesh;
        }));
    }

    // The name of the device, or none where the CPU extracts.
    std::optional<std::string> device() const {
        const std::lock_guard lock(failure_mutex_);
        return device_name_ && failure_.empty() ? device_name_ : std::nullopt;
    }

    // Why the CPU took over from the device; empty if it did not.
    std::string failure() const {
        const std::lock_guard lock(failure_mutex_);
        return failure_.empty() ? failure_ : "the CPU extracts instead of " + *device_name_ + ": " + failure_;
    }

  private:
    void note_failure() {
        const std::lock_guard lock(failure_mutex_);
        failure_ = extractor_.failure();
    }

    std::unique_lock<std::timed_mutex> wait_for_turn(const Progress& report) {
        std::unique_lock turn(mutex_, std::defer_lock);
        while (!turn.try_lock_for(std::chrono::milliseconds(50))) {
            if (!report(0)) throw Cancelled();
        }
        return turn;
    }

    // The mesh of an earlier call whose arrays are gone, so that its memory need not be touched for the first
    // time again; otherwise a new one. At most one unused mesh is kept.
    std::shared_ptr<Mesh> unused_mesh() {
        if (last_.use_count() != 1) last_ = std::make_shared<Mesh>();
        std::atomic_thread_fence(
            std::memory_order_acquire);  // use_count does not wait for readers of the mesh
        return last_;
    }

    const ArrayVolume volume_;
    std::timed_mutex mutex_;
    Progress report_;  // of the call whose turn it is
    std::shared_ptr<Mesh> last_;
    std::optional<std::string> device_name_;
    std::string failure_;               // of the extractor
    mutable std::mutex failure_mutex_;  // never held for long
    gpu::FallbackExtractor extractor_;
};

}  // namespace

void add_isosurface(py::module_& module) {
    module.def("tissue_presets", [] {
        py::list presets;
        for (const Preset& preset : kPresets)
            presets.append(py::make_tuple(py::str(std::string(preset.name)), preset.lowest, preset.isovalue(),
                                          py::tuple(py::cast(preset.colour))));
        return presets;
    });
    module.def(
        "presets_apply",
        [](const std::string& modality, bool is_dicom, double lowest) {
            return presets_apply(modality, is_dicom ? ScanFormat::dicom : ScanFormat::nrrd, lowest);
        },
        py::arg("modality"), py::arg("is_dicom"), py::arg("lowest"));
    module.def("extract", &extract, py::arg("volume"), py::arg("isovalue"), py::kw_only(),
               py::arg("closed") = false, py::arg("normals") = true, py::arg("snap") = 0.0,
               py::arg("topology") = false, py::arg("threads") = 0, py::arg("progress") = py::none());
    py::class_<ArrayExtractor>(module, "ArrayExtractor")
        .def(py::init<const ArrayVolume&, bool, bool, double, bool, int, const std::string&>(),
             py::arg("volume"), py::kw_only(), py::arg("closed") = false, py::arg("normals") = true,
             py::arg("snap") = 0.0, py::arg("topology") = false, py::arg("threads") = 0,
             py::arg("device") = "cpu")
        .def_property_readonly("device", &ArrayExtractor::device)
        .def_property_readonly("failure", &ArrayExtractor::failure)
        .def("extract", &ArrayExtractor::extract, py::arg("isovalue"), py::kw_only(), py::arg("level") = 0,
             py::arg("progress") = py::none());
}

}  // namespace marrow::python
