// Parses the tags of XML files.
#include "xml.h"

#include <algorithm>

#include "text.h"

namespace marrow::internal::io {

namespace {

// The offset after the first closing bracket from `at` on that is not in quotes.
std::size_t end_of_tag(const FileContent& input, std::size_t at) {
    const std::string& text = input.bytes;
    for (;;) {
        at = text.find_first_of(">\"'", at);
        if (at == text.npos) input.refuse("the XML is cut off");
        if (text[at] == '>') return at + 1;
        at = text.find(text[at], at + 1);
        if (at == text.npos) input.refuse("an XML attribute is cut off");
        ++at;
    }
}

}  // namespace

std::string_view XmlTag::get(std::string_view attribute) const {
    for (const auto& [name, value] : attributes) {
        if (name == attribute) return value;
    }
    return {};
}

bool next_tag(const FileContent& input, std::size_t at, XmlTag& tag) {
    const std::string_view text = input.bytes;
    tag.attributes.clear();
    for (;; at = tag.end) {
        tag.begin = text.find('<', at);
        if (tag.begin == text.npos) return false;
        if (text.substr(tag.begin).starts_with("<!--")) {
            const std::size_t close = text.find("-->", tag.begin);
            if (close == text.npos) input.refuse("an XML comment is cut off");
            tag.end = close + 3;
            continue;
        }
        tag.end = end_of_tag(input, tag.begin + 1);
        if (text[tag.begin + 1] != '!' && text[tag.begin + 1] != '?') break;
    }
    std::string_view inside = text.substr(tag.begin + 1, tag.end - tag.begin - 2);
    if (inside.ends_with('/')) inside.remove_suffix(1);
    const std::size_t name_end = std::min(inside.find_first_of(" \t\r\n"), inside.size());
    tag.name = inside.substr(0, name_end);
    for (inside.remove_prefix(name_end); !inside.empty();) {
        const std::size_t equals = inside.find('=');
        const std::size_t open = inside.find_first_of("\"'");
        if (equals == inside.npos || open == inside.npos || open < equals) break;
        const std::size_t close = inside.find(inside[open], open + 1);
        if (close == inside.npos) input.refuse("an XML attribute is damaged");
        tag.attributes.emplace_back(trimmed(inside.substr(0, equals)),
                                    inside.substr(open + 1, close - open - 1));
        inside.remove_prefix(close + 1);
    }
    return true;
}

}  // namespace marrow::internal::io
