#include "noise.h"

#include "long_work.h"

namespace py = pybind11;

namespace marrow::python {

NoiseEstimate noise_of(const ArrayVolume& volume, std::optional<double> padding, int threads) {
    const ArrayVolume ordered = volume.in_array_order();
    return compute(py::none(), [&](const Progress& report) {
        return estimate_noise(ordered.view(), {.padding = padding, .threads = threads, .progress = report});
    });
}

}  // namespace marrow::python
