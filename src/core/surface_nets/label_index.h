/// Finds which label values a map has, and converts values to indices among them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "borders.h"

namespace marrow::internal {

/// The index of a label among the values of its map, which are in ascending order.
using LabelIndex = std::uint16_t;
constexpr std::size_t kMostLabelValues = 65536;  ///< including the background

/// Remembers something about recent labels: one entry for each lowest byte, since most maps have few and
/// small labels.
template <class T, class Entry>
class RecentLabels {
  public:
    explicit RecentLabels(const Entry& initial) { entries_.fill(initial); }
    Entry& entry(T label) { return entries_[static_cast<std::uint8_t>(static_cast<std::int64_t>(label))]; }

  private:
    std::array<Entry, 256> entries_;
};

/// Converts a label to its index in `values`, which must outlive the finder and contain the label.
template <class T>
class LabelIndexFinder {
  public:
    explicit LabelIndexFinder(const std::vector<std::int64_t>& values)
        : values_(values), recent_({static_cast<T>(values[0]), 0}) {}

    LabelIndex operator()(T label) {
        Found& found = recent_.entry(label);
        if (found.label != label) {
            const auto it =
                std::lower_bound(values_.begin(), values_.end(), static_cast<std::int64_t>(label));
            found = {label, static_cast<LabelIndex>(it - values_.begin())};
        }
        return found.index;
    }

  private:
    struct Found {
        T label;
        LabelIndex index;
    };
    const std::vector<std::int64_t>& values_;
    RecentLabels<T, Found> recent_;
};

/// The labels of a map and its background, in ascending order.
/// \throw InputError more than kMostLabelValues of them; Cancelled
std::vector<std::int64_t> find_label_values(const LabelMap& map, const BorderBits& bits,
                                            const Progress& progress);

}  // namespace marrow::internal
