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

}  // namespace marrow::apps
