// Meshes from STL and OBJ; the other formats have files of their own.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "reader.h"
#include "writer.h"

namespace marrow {

namespace {

// The words of a text file, line by line.
class Lines {
  public:
    explicit Lines(std::string_view text) : rest_(text) {}

    bool next(std::string_view& line) {
        if (rest_.empty()) return false;
        const std::size_t end = std::min(rest_.find('\n'), rest_.size());
        line = rest_.substr(0, end);
        rest_.remove_prefix(std::min(end + 1, rest_.size()));
        return true;
    }

  private:
    std::string_view rest_;
};

Vec3f coordinates(const FileContent& input, const std::vector<std::string_view>& words) {
    if (words.size() < 4) input.refuse("a point has fewer than three coordinates");
    Vec3f point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = number(words[axis + 1]);
        if (!value) input.refuse("a coordinate is no number: " + shown(words[axis + 1]));
        point[axis] = static_cast<float>(*value);
    }
    return point;
}

// STL names no points: those of the same coordinates become one, so that triangles are neighbours again. -0 is 0.
Mesh with_shared_points(const std::vector<Vec3f>& corners) {
    std::vector<std::uint64_t> order(corners.size());
    std::iota(order.begin(), order.end(), std::uint64_t{0});
    std::sort(order.begin(), order.end(), [&](std::uint64_t a, std::uint64_t b) {
        return corners[a] != corners[b] ? corners[a] < corners[b] : a < b;
    });
    // Each corner's first equal; then points are numbered in the order of the file.
    std::vector<std::uint64_t> first(corners.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && corners[order[i]] == corners[order[i - 1]];
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    Mesh mesh;
    std::vector<std::uint32_t> index(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
        if (first[i] == i) {
            index[i] = static_cast<std::uint32_t>(mesh.points.size());
            mesh.points.push_back(corners[i]);
        }
    }
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        mesh.triangles.push_back({index[first[i]], index[first[i + 1]], index[first[i + 2]]});
    return mesh;
}

Mesh read_stl(const FileContent& input, std::optional<Space>& space) {
    constexpr std::size_t kHeader = 84, kFacet = 50;
    const std::string& bytes = input.bytes;
    std::vector<Vec3f> corners;
    std::uint32_t count = 0;
    if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
    if (bytes.size() >= kHeader && bytes.size() == kHeader + kFacet * std::size_t{count}) {
        space = marked_space(std::string_view(bytes).substr(0, 80));
        corners.resize(3 * std::size_t{count});
        for (std::size_t t = 0; t < count; ++t)
            std::memcpy(&corners[3 * t], bytes.data() + kHeader + kFacet * t + 12, 36);
        refuse_non_finite(input, corners);
        return with_shared_points(corners);
    }
    if (!trimmed(std::string_view(bytes).substr(0, 80)).starts_with("solid"))
        input.refuse("neither a text STL file nor a binary one whose length fits its " +
                     std::to_string(count) + " triangles; it may be cut off");
    Lines lines(bytes);
    bool ended = false;
    for (std::string_view line; lines.next(line);) {
        const std::vector<std::string_view> w = words(line);
        if (w.empty()) continue;
        if (lower(w[0]) == "solid") space = marked_space(line);
        if (lower(w[0]) == "endsolid") ended = true;
        if (lower(w[0]) == "vertex") corners.push_back(coordinates(input, w));
    }
    if (!ended || corners.size() % 3 != 0) input.refuse("the text STL file is cut off");
    refuse_non_finite(input, corners);
    return with_shared_points(corners);
}

Mesh read_obj(const FileContent& input, std::optional<Space>& space) {
    Mesh mesh;
    std::vector<std::int64_t> corners;
    Lines lines(input.bytes);
    for (std::string_view line; lines.next(line);) {
        if (line.starts_with('#') && !space) space = marked_space(line);
        const std::vector<std::string_view> w = words(line);
        if (w.empty()) continue;
        if (w[0] == "v") mesh.points.push_back(coordinates(input, w));
        if (w[0] != "f") continue;
        corners.clear();
        for (std::size_t i = 1; i < w.size(); ++i) {
            const std::optional<std::int64_t> index = integer(w[i].substr(0, w[i].find('/')));
            if (!index || *index == 0) input.refuse("a corner is no point's number: " + shown(w[i]));
            // Counted from 1, or backwards from the last point.
            corners.push_back(*index > 0 ? *index - 1
                                         : *index + static_cast<std::int64_t>(mesh.points.size()));
        }
        add_polygon(input, corners, mesh.points.size(), mesh);
    }
    return mesh;
}

}  // namespace

void add_polygon(const FileContent& input, const std::vector<std::int64_t>& corners, std::size_t points,
                 Mesh& mesh) {
    if (corners.size() < 3) input.refuse("a face has fewer than three corners");
    for (const std::int64_t c : corners) {
        if (c < 0 || c >= static_cast<std::int64_t>(points))
            input.refuse("a face names point " + std::to_string(c) + ", which is not there");
    }
    for (std::size_t i = 2; i < corners.size(); ++i)
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[i - 1]),
                                  static_cast<std::uint32_t>(corners[i])});
}

void refuse_non_finite(const FileContent& input, std::span<const Vec3f> points) {
    for (const Vec3f& p : points) {
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
            input.refuse("a coordinate is NaN or infinite");
    }
}

std::optional<Space> marked_space(std::string_view text) {
    if (text.find("SPACE=RAS") != text.npos) return Space::RAS;
    if (text.find("SPACE=LPS") != text.npos) return Space::LPS;
    return std::nullopt;
}

Mesh read_mesh(const std::filesystem::path& path, std::optional<Space>* stated) {
    const MeshFormat format = mesh_format(path);
    const FileContent input = read_content(path, is_gzipped(path) ? Compression::zlib : Compression::none);
    std::optional<Space> space;
    Mesh mesh;
    if (format == MeshFormat::stl) mesh = read_stl(input, space);
    if (format == MeshFormat::ply) mesh = read_ply(input, space);
    if (format == MeshFormat::obj) mesh = read_obj(input, space);
    if (format == MeshFormat::vtp) mesh = read_vtp(input, space);
    if (format == MeshFormat::threemf) mesh = read_3mf(input, space);
    if (format == MeshFormat::glb) mesh = read_glb(input, space);
    refuse_non_finite(input, mesh.points);
    if (mesh.points.size() >> 32) throw LimitError(shown(path) + ": has 2^32 points or more");
    if (space == Space::RAS) {
        for (Vec3f& p : mesh.points) p = {-p[0], -p[1], p[2]};
    }
    if (stated) *stated = space;
    return mesh;
}

}  // namespace marrow
