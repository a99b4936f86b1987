// Samples by their type.
#pragma once

#include <marrow/volume.h>

namespace marrow::viewer {

/// Calls `use` with the volume's samples as what they are.
template <class Use>
auto with_samples(const Volume& volume, Use use) {
    switch (volume.type()) {
        case SampleType::uint8:
            return use(volume.samples<std::uint8_t>());
        case SampleType::int8:
            return use(volume.samples<std::int8_t>());
        case SampleType::uint16:
            return use(volume.samples<std::uint16_t>());
        case SampleType::int16:
            return use(volume.samples<std::int16_t>());
        case SampleType::int32:
            return use(volume.samples<std::int32_t>());
        case SampleType::float32:
            return use(volume.samples<float>());
        case SampleType::float64:
            break;
    }
    return use(volume.samples<double>());
}

}  // namespace marrow::viewer
