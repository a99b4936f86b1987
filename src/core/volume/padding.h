/// Samples outside a scan's field of view.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include <marrow/volume.h>

namespace marrow::internal {

/// Tells samples of type T that are padding from others.
template <class T>
class Padding {
  public:
    /// `value` is that of padding (ScanInfo::padding), if there is any.
    Padding(const Rescale& rescale, std::optional<double> value) {
        if (!value) return;
        const double sample = rescale.sample(*value);
        if constexpr (std::is_integral_v<T>) {
            const bool is_of_type = sample == std::round(sample) &&
                                    sample >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
                                    sample <= static_cast<double>(std::numeric_limits<T>::max());
            if (is_of_type) sample_ = static_cast<T>(sample);
        } else {
            sample_ = static_cast<T>(sample);  // values that became float32 are the nearest to it
        }
    }

    bool contains(T sample) const { return sample_ && sample == *sample_; }

  private:
    std::optional<T> sample_;
};

}  // namespace marrow::internal
