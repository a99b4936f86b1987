// Reads Wavefront OBJ: points, faces and objects.
#include <algorithm>

#include "io/bytes/text.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 32;  // that an index of a triangle can name

// Removes the first line, which a line feed, a carriage return or both end.
std::string_view take_any_line(std::string_view& text) {
    const auto end = std::find_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
    const std::string_view line(text.begin(), end);
    text.remove_prefix(line.size());
    text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, text.size()));
    return line;
}

// Removes the first line, and those that continue it after a backslash; `joined` holds them.
std::string_view take_statement(std::string_view& text, std::string& joined) {
    std::string_view line = take_any_line(text);
    // A comment may end with the path of a folder.
    if (!line.ends_with('\\') || line.starts_with('#')) return line;
    joined.clear();
    for (; line.ends_with('\\'); line = take_any_line(text)) {
        line.remove_suffix(1);
        joined.append(line).append(" ");
    }
    return joined.append(line);
}

}  // namespace

Mesh read_obj(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress) {
    // Other programs may leave out the last newline, so that their files do not show that they are cut off.
    const bool is_marrows = input.bytes.starts_with("# Marrow ");
    if (is_marrows && !input.bytes.ends_with('\n')) input.refuse("the file is cut off");
    Mesh mesh;
    std::vector<std::int64_t> corners;
    std::string joined;
    ReadingProgress reading(progress);
    const auto size = static_cast<double>(input.bytes.size());
    std::string_view rest = input.bytes;
    if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);  // the byte order mark of UTF-8
    while (!rest.empty()) {
        reading(size - static_cast<double>(rest.size()), size);
        const std::string_view line = take_statement(rest, joined);
        if (line.starts_with('#') && space == Space::none) space = stated_space(line);
        const std::vector<std::string_view> w = split(line);
        if (w.empty()) continue;
        if (w[0] == "v") mesh.points.push_back(parse_point(input, w));
        if (w[0] == "o")
            objects.push_back({std::string(trimmed(trimmed(line).substr(1))), mesh.triangles.size()});
        if (w[0] != "f") continue;
        corners.clear();
        for (std::size_t i = 1; i < w.size(); ++i) {
            const std::optional<std::int64_t> index = parse_integer(w[i].substr(0, w[i].find('/')));
            if (!index || *index == 0) input.refuse("a corner is not the number of a point: " + quoted(w[i]));
            // Indices count from 1, or backwards from the last point if they are negative.
            const std::int64_t corner =
                *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(mesh.points.size());
            if (corner < 0 || corner >= static_cast<std::int64_t>(kMostPoints))
                refuse_missing_point(input, *index);
            corners.push_back(corner);
        }
        // A face may come before its points.
        add_polygon(input, corners, kMostPoints, mesh);
    }
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t p : t) {
            if (p >= mesh.points.size()) refuse_missing_point(input, std::int64_t{p} + 1);
        }
    }
    if (mesh.points.empty() && !is_marrows) input.refuse("is not an OBJ file, or has no points");
    return mesh;
}

}  // namespace marrow::internal::io
