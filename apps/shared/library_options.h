/// Names the flags of the command line in messages of the library.
#pragma once

#include <string>

namespace marrow::apps {

/// A message of the library, with flags in place of the library's options. The library knows no flags: where
/// an option would help, its message says so as "options.series". That becomes "--series".
std::string name_flags(std::string message);

}  // namespace marrow::apps
