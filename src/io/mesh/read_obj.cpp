// Reads Wavefront OBJ: points, faces and objects.
#include "io/bytes/text.h"
#include "reader.h"

namespace marrow::internal::io {

Mesh read_obj(const FileContent& input, Space& space, std::vector<ObjectStart>& objects) {
    Mesh mesh;
    std::vector<std::int64_t> corners;
    for (std::string_view rest = input.bytes; !rest.empty();) {
        const std::string_view line = take_line(rest);
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
            corners.push_back(*index > 0 ? *index - 1
                                         : *index + static_cast<std::int64_t>(mesh.points.size()));
        }
        add_polygon(input, corners, mesh.points.size(), mesh);
    }
    return mesh;
}

}  // namespace marrow::internal::io
