/// Samples outside a scan's field of view.
#pragma once

#include <optional>
#include <type_traits>

#include <marrow/volume.h>

namespace marrow::internal {

/// Tells samples of type T that are padding from others.
template <class T>
class Padding {
  public:
    /// `value` is that of padding (ScanInfo::padding), if there is any.
    Padding(const Rescale& rescale, std::optional<double> value) : rescale_(rescale), value_(value) {}

    bool contains(T sample) const {
        return value_ && static_cast<Compared>(rescale_.value(static_cast<double>(sample))) ==
                             static_cast<Compared>(*value_);
    }

  private:
    // Values that became float32 are equal to the padding if they are the nearest to it.
    using Compared = std::conditional_t<std::is_same_v<T, float>, float, double>;

    const Rescale rescale_;
    const std::optional<double> value_;
};

}  // namespace marrow::internal
