/// Text of files, such as names and descriptions, for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

#include <marrow/export.h>

namespace marrow {

/// Returns text that stays on its line and changes nothing on a terminal: control characters and bytes that
/// are not UTF-8 are escaped, as in the messages of Error.
MARROW_EXPORT std::string printable(std::string_view text);

}  // namespace marrow
