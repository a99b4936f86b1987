/// Finds what a mistyped name was meant to be.
#pragma once

#include <string>
#include <vector>

namespace marrow::apps {

/// The end of a message about the unknown `name`, such as ": did you mean --smooth?", from those of the
/// `known` names that are most like it. Empty if none is.
std::string did_you_mean(const std::string& name, const std::vector<std::string>& known);

}  // namespace marrow::apps
