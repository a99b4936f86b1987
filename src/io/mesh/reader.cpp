// What the readers of mesh formats share.
#include "reader.h"

#include "base/all_finite.h"
#include "io/bytes/text.h"

namespace marrow::internal::io {

void refuse_missing_point(const FileContent& input, std::int64_t point) {
    input.refuse("a face names point " + std::to_string(point) + ", which is missing");
}

void add_polygon(const FileContent& input, const std::vector<std::int64_t>& corners, std::size_t points,
                 Mesh& mesh) {
    if (corners.size() < 3) input.refuse("a face has fewer than three corners");
    for (const std::int64_t c : corners) {
        if (c < 0 || c >= static_cast<std::int64_t>(points)) refuse_missing_point(input, c);
    }
    for (std::size_t i = 2; i < corners.size(); ++i)
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[i - 1]),
                                  static_cast<std::uint32_t>(corners[i])});
}

void check_finite(const FileContent& input, std::span<const Vec3f> points) {
    if (!all_finite(points)) input.refuse("a coordinate is NaN or infinite");
}

Vec3f parse_point(const FileContent& input, const std::vector<std::string_view>& words) {
    if (words.size() < 4) input.refuse("a point has fewer than three coordinates");
    Vec3f point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = parse_double(words[axis + 1]);
        if (!value) input.refuse("a coordinate is not a number: " + quoted(words[axis + 1]));
        point[axis] = static_cast<float>(*value);
    }
    return point;
}

Space stated_space(std::string_view text) {
    if (text.find("SPACE=RAS") != text.npos) return Space::RAS;
    if (text.find("SPACE=LPS") != text.npos) return Space::LPS;
    return Space::none;
}

}  // namespace marrow::internal::io
