/// The noise of a scan.
#pragma once

#include <optional>

#include <marrow/trust.h>

#include "volume.h"

namespace marrow::python {

/// Estimates the noise of an array, within and between the slices array[k], in whichever order it lies in
/// memory.
NoiseEstimate noise_of(const ArrayVolume& volume, std::optional<double> padding, int threads);

}  // namespace marrow::python
