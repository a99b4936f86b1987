/// Numbers for people to read.
#pragma once

#include <string>

namespace marrow::apps {

/// A number with this many decimals; with four significant digits where these would leave one at most.
std::string decimal_text(double number, int decimals);

}  // namespace marrow::apps
