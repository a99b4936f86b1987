/// How a volume stores its samples, in words.
#pragma once

#include <string>

#include <marrow/volume.h>

namespace marrow::apps {

/// "int16", or "int16 * 0.5 - 1000.5" where the samples stand for other values.
std::string sample_text(SampleType type, const Rescale& rescale);

}  // namespace marrow::apps
