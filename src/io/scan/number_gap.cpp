// Finds the largest step in the numbers of slices.
#include "number_gap.h"

#include <algorithm>

#include <fmt/format.h>

namespace marrow::internal::io {

std::string number_gap(const std::vector<std::int64_t>& growths,
                       const std::function<std::string(std::size_t)>& name) {
    if (growths.empty()) return {};
    const auto [least, most] = std::minmax_element(growths.begin(), growths.end());
    if (*least == *most) return {};
    const auto at = static_cast<std::size_t>(most - growths.begin());
    return fmt::format(
        "the numbers of the slices grow by {} from {} to {} and by {} elsewhere: slices may be missing",
        *most, name(at), name(at + 1), *least);
}

}  // namespace marrow::internal::io
