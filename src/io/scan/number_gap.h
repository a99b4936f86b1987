/// Slices whose numbers show that some of them may be missing.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace marrow::internal::io {

/// A warning if the numbers of slices skip one; empty if they do not. `growths`: by how much the number grows
/// from each slice to the next, where that is known. `name`: names a slice
std::string number_gap(const std::vector<std::optional<std::int64_t>>& growths,
                       const std::function<std::string(std::size_t)>& name);

}  // namespace marrow::internal::io
