/// Which labels a map has.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "borders.h"

namespace marrow::internal {

/// A label's place among the map's, in ascending order.
using Place = std::uint16_t;

/// What is remembered of the last 256 labels: one each for labels with different lowest bits, as they are few and mostly small.
template <class T, class Known>
class Recent {
  public:
    explicit Recent(const Known& known) { known_.fill(known); }
    Known& of(T label) { return known_[static_cast<std::uint8_t>(static_cast<std::int64_t>(label))]; }

  private:
    std::array<Known, 256> known_;
};

/// Where each of a map's labels is among `values`.
template <class T>
class Places {
  public:
    explicit Places(const std::vector<std::int64_t>& values)
        : values_(values), recent_({static_cast<T>(values[0]), 0}) {}
    Place operator()(T value) {
        Found& found = recent_.of(value);
        if (found.value != value) {
            const auto at =
                std::lower_bound(values_.begin(), values_.end(), static_cast<std::int64_t>(value));
            found = {value, static_cast<Place>(at - values_.begin())};
        }
        return found.place;
    }

  private:
    struct Found {
        T value;
        Place place;
    };
    const std::vector<std::int64_t>& values_;
    Recent<T, Found> recent_;
};

/// The values of a map and its background, ascending. \throw InputError more than 65535
std::vector<std::int64_t> find_values(const LabelMap& map, const BorderBits& bits);

}  // namespace marrow::internal
