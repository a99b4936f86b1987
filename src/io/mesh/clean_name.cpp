// Makes names valid UTF-8, and names objects that have none.
#include <fmt/format.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

// The number of bytes of the first character; 0 if it is not valid UTF-8.
std::size_t length_of_character(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned lead = byte(0);
    if (lead < 0x80) return 1;
    const std::size_t length = lead >= 0xc2 && lead < 0xe0   ? 2
                               : lead >= 0xe0 && lead < 0xf0 ? 3
                               : lead >= 0xf0 && lead < 0xf5 ? 4
                                                             : 0;
    unsigned code = lead & (0xffu >> (length + 1));
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return 0;
        code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr unsigned kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    const bool surrogate = code >= 0xd800 && code < 0xe000, noncharacter = (code & 0xfffe) == 0xfffe;
    return code >= kLeast[length] && code <= 0x10ffff && !surrogate && !noncharacter ? length : 0;
}

}  // namespace

std::string clean_name(const std::string& name) {
    constexpr std::string_view kReplacement = "\xef\xbf\xbd";
    std::string clean;
    for (std::string_view rest = name; !rest.empty();) {
        const std::size_t length = length_of_character(rest);
        const auto first = static_cast<unsigned char>(rest.front());
        const bool control = first < 0x20 || first == 0x7f ||
                             (first == 0xc2 && length == 2 && static_cast<unsigned char>(rest[1]) < 0xa0);
        clean += length == 0 || control ? kReplacement : rest.substr(0, length);
        rest.remove_prefix(length == 0 ? 1 : length);
    }
    return clean;
}

std::string name_or_number(MeshObjects objects, std::size_t index) {
    const std::string& name = objects[index].name;
    return name.empty() ? fmt::format("surface {}", index + 1) : name;
}

}  // namespace marrow::internal::io
