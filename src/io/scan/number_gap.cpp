// Finds the largest step in the numbers of slices.
#include "number_gap.h"

#include <algorithm>

#include <fmt/format.h>

namespace marrow::internal::io {

std::string number_gap(const std::vector<std::optional<std::int64_t>>& growths,
                       const std::function<std::string(std::size_t)>& name) {
    // Nothing is less than any number.
    const auto most = std::max_element(growths.begin(), growths.end());
    if (most == growths.end() || !*most) return {};
    std::int64_t least = **most;
    for (const auto& growth : growths) least = std::min(least, growth.value_or(least));
    if (least == **most) return {};
    const auto at = static_cast<std::size_t>(most - growths.begin());
    return fmt::format(
        "the numbers of the slices grow by {} from {} to {} and by {} elsewhere: slices may be missing",
        **most, name(at), name(at + 1), least);
}

}  // namespace marrow::internal::io
