// Describes the samples of a volume.
#include "sample_text.h"

#include <cmath>

#include <fmt/format.h>

namespace marrow::apps {

std::string sample_text(SampleType type, const Rescale& rescale) {
    const auto& [slope, intercept] = rescale;
    std::string text = sample_type_name(type);
    if (slope != 1) text += fmt::format(" * {:.7g}", slope);
    if (intercept != 0) text += fmt::format(" {} {:.7g}", intercept < 0 ? '-' : '+', std::abs(intercept));
    return text;
}

std::string value_text(double value) {
    constexpr double kMostDigits = 1e15;  // beyond these, not every whole number is a double
    const bool is_whole = std::trunc(value) == value && std::abs(value) < kMostDigits;
    return is_whole ? fmt::format("{:.0f}", value + 0.0) : fmt::format("{:.7g}", value);
}

}  // namespace marrow::apps
