/// Chooses a device by what a user says.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/gpu.h>

namespace marrow::gpu::internal {

/// What there is to choose from.
struct Choices {
    std::vector<Device> usable;
    std::vector<UnusableDevice> unusable;
    std::string why_none;  ///< of either kind
};

/// As choose_device().
std::optional<std::size_t> choose_among(const Choices& choices, std::string_view choice);

}  // namespace marrow::gpu::internal
