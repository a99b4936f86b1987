/// The one definition of "inside".
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

namespace marrow::internal {

/// The smallest T that is inside, so that `sample >= *threshold` is exactly `sample >= isovalue`. Nothing if
/// no finite T is inside. \pre isovalue is finite
template <class T>
std::optional<T> inside_threshold(double isovalue) {
    using Limits = std::numeric_limits<T>;
    if (isovalue > static_cast<double>(Limits::max())) return std::nullopt;
    if (isovalue <= static_cast<double>(Limits::lowest())) return Limits::lowest();
    if constexpr (std::is_integral_v<T>) {
        return static_cast<T>(std::ceil(isovalue));
    } else {
        const T rounded = static_cast<T>(isovalue);
        return static_cast<double>(rounded) < isovalue ? std::nextafter(rounded, Limits::infinity())
                                                       : rounded;
    }
}

/// A sample is inside if it is finite and at or above the threshold. NaN and infinities are outside.
template <class T>
bool is_inside(T sample, T threshold) {
    return sample >= threshold && sample <= std::numeric_limits<T>::max();
}

}  // namespace marrow::internal
