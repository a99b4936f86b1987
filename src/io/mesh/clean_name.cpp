// Makes names valid UTF-8, and names objects that have none.
#include <fmt/format.h>

#include "io/bytes/text.h"
#include "writer.h"

namespace marrow::internal::io {
std::string clean_name(const std::string& name) {
    constexpr std::string_view kReplacement = "\xef\xbf\xbd";
    std::string clean;
    for (std::string_view rest = name; !rest.empty();) {
        const Character character = first_character(rest);
        clean += character.is_valid && !character.is_control ? character.bytes : kReplacement;
        rest.remove_prefix(character.bytes.size());
    }
    return clean;
}

std::string name_or_number(MeshObjects objects, std::size_t index) {
    const std::string& name = objects[index].name;
    return name.empty() ? fmt::format("surface {}", index + 1) : name;
}

}  // namespace marrow::internal::io
