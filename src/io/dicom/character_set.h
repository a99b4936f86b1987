/// Converts the text of DICOM files to UTF-8.
#pragma once

#include <optional>
#include <string>

namespace marrow::internal::io {

/// Converts text to UTF-8. `character_set` is the file's SpecificCharacterSet (0008,0005). No value if the
/// character set is unknown or the text is not in it.
std::optional<std::string> to_utf8(const std::string& text, const std::string& character_set);

}  // namespace marrow::internal::io
