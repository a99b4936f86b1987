/// Parses the tags of XML files, as far as VTP and 3MF need it.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "file_content.h"

namespace marrow::internal::io {

/// A tag; its views point into the file's content.
struct XmlTag {
    std::string_view name;  ///< an end tag's name starts with a slash
    std::vector<std::pair<std::string_view, std::string_view>> attributes;
    std::size_t begin = 0, end = 0;  ///< offsets of its first byte and after its last one

    /// An attribute's value, with entities as they are; empty if it is absent.
    std::string_view get(std::string_view attribute) const;
};

/// Finds the next tag from offset `at` on, but no comment or declaration. Returns false if there is none.
/// \throw InputError a tag is cut off
bool next_tag(const FileContent& input, std::size_t at, XmlTag& tag);

}  // namespace marrow::internal::io
