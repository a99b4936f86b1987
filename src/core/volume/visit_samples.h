/// From a SampleType at run time to a C++ type.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

namespace marrow::internal {

/// Calls `f` with a value of the sample's C++ type. \pre type is valid
template <class F>
decltype(auto) with_sample_type(SampleType type, F&& f) {
    switch (type) {
        case SampleType::uint8:
            return f(std::uint8_t{});
        case SampleType::int8:
            return f(std::int8_t{});
        case SampleType::uint16:
            return f(std::uint16_t{});
        case SampleType::int16:
            return f(std::int16_t{});
        case SampleType::int32:
            return f(std::int32_t{});
        case SampleType::float32:
            return f(float{});
        case SampleType::float64:
            break;
    }
    return f(double{});
}

}  // namespace marrow::internal
