// The tags of XML files, as VTP and 3MF have them.
#pragma once

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "file_content.h"

namespace marrow {

/// A tag; its texts lie in the file.
struct XmlTag {
    std::string_view name;  ///< with a slash before an end tag's
    std::vector<std::pair<std::string_view, std::string_view>> attributes;
    std::size_t begin = 0, end = 0;  ///< in the file; end is behind the bracket

    /// An attribute's value as it stands there; empty where there is none.
    std::string_view get(std::string_view attribute) const;
};

/// Finds the next tag from `at` on, comments and declarations left out; false where there is none. \throw
/// InputError a tag without an end
bool next_tag(const FileContent& input, std::size_t at, XmlTag& tag);

}  // namespace marrow
