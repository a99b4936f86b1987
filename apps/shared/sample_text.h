/// Samples in words: how a volume stores them, and what they are.
#pragma once

#include <string>

#include <marrow/volume.h>

namespace marrow::apps {

/// "int16", or "int16 * 0.5 - 1000.5" where the samples stand for other values.
std::string sample_text(SampleType type, const Rescale& rescale);

/// A sample or an isovalue: a whole number with all of its digits, any other one with the seven of float32.
std::string value_text(double value);

}  // namespace marrow::apps
