/// Reads the attributes that tell the volumes of a DICOM series apart.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "data_set.h"

namespace marrow::internal::io {

/// What the volumes of a series may differ in, in the order in which it is tried: first what they show, then
/// when they were acquired.
enum class VolumeAttribute {
    image_type,         ///< magnitude, phase, real or imaginary part, water, fat, ...
    complex_component,  ///< the same in enhanced files
    kernel,             ///< of the reconstruction
    echo_time,
    echo_number,
    b_value,
    gradient,  ///< the direction of diffusion weighting
    temporal_position,
    cardiac_phase,
    trigger_time,
    frame_reference_time,
    acquisition_number,
    dimension_indices,  ///< of an enhanced file, apart from those of the slice in its stack
    acquisition_time,
    instance_number
};
inline constexpr std::size_t kVolumeAttributes = 15;

/// The values of one frame, as text; empty if the frame does not state them.
using VolumeAttributes = std::array<std::string, kVolumeAttributes>;

/// Reads the attributes of `frames` frames. `per_frame` and `shared` are the functional groups of an enhanced
/// file, or empty. \throw InputError a sequence is damaged
std::vector<VolumeAttributes> read_volume_attributes(const DicomDataSet& data_set,
                                                     const std::vector<DicomDataSet>& per_frame,
                                                     const std::vector<DicomDataSet>& shared,
                                                     std::size_t frames);

/// Names a value for people: "echo time 12.5 ms".
std::string describe_attribute(VolumeAttribute attribute, const std::string& value);

}  // namespace marrow::internal::io
