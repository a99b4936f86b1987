// Reads binary and text STL.
#include <algorithm>
#include <cstring>
#include <numeric>

#include "io/bytes/text.h"
#include "reader.h"
#include "writer.h"

namespace marrow::internal::io {

namespace {

// STL has no shared points. Corners with the same coordinates become one point, so that triangles are
// connected; -0 is equal to 0.
Mesh with_shared_points(const FileContent& input, const std::vector<Vec3f>& corners) {
    check_finite(input, corners);  // NaN has no place in an order
    std::vector<std::uint64_t> order(corners.size());
    std::iota(order.begin(), order.end(), std::uint64_t{0});
    std::sort(order.begin(), order.end(), [&](std::uint64_t a, std::uint64_t b) {
        return corners[a] != corners[b] ? corners[a] < corners[b] : a < b;
    });
    // Each corner's first equal corner. Points are numbered in the order of the file.
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

}  // namespace

Mesh read_stl(const FileContent& input, Space& space) {
    const std::string& bytes = input.bytes;
    std::vector<Vec3f> corners;
    std::uint32_t count = 0;
    if (bytes.size() >= kStlHeaderBytes) std::memcpy(&count, bytes.data() + 80, sizeof count);
    if (bytes.size() >= kStlHeaderBytes &&
        bytes.size() == kStlHeaderBytes + kStlFacetBytes * std::size_t{count}) {
        space = stated_space(std::string_view(bytes).substr(0, 80));
        corners.resize(3 * std::size_t{count});
        for (std::size_t t = 0; t < count; ++t)
            std::memcpy(&corners[3 * t], bytes.data() + kStlHeaderBytes + kStlFacetBytes * t + 12, 36);
        return with_shared_points(input, corners);
    }
    if (!to_lower(trimmed(std::string_view(bytes).substr(0, 80))).starts_with("solid"))
        input.refuse("is neither a text STL file nor a binary one with the length of its " +
                     std::to_string(count) + " triangles; it may be cut off");
    bool ended = false;
    std::size_t facets = 0;
    const auto check_facets = [&] {
        if (corners.size() != 3 * facets)
            input.refuse("facet " + std::to_string(facets) +
                         " does not have three vertices; save it again as triangles");
    };
    std::string_view rest = bytes;
    if (rest.ends_with('\0')) rest.remove_suffix(1);  // what DICOM adds to an odd number of bytes
    while (!rest.empty()) {
        const std::string_view line = take_line(rest);
        const std::vector<std::string_view> w = split(line);
        if (w.empty()) continue;
        const std::string keyword = to_lower(w[0]);
        if (keyword == "solid" && space == Space::none) space = stated_space(line);
        if (keyword == "facet") {
            check_facets();
            ++facets;
        }
        if (keyword == "vertex") corners.push_back(parse_point(input, w));
        if (keyword == "solid" || keyword == "endsolid") ended = keyword == "endsolid";
    }
    if (!ended) input.refuse("the text STL file is cut off");
    check_facets();
    return with_shared_points(input, corners);
}

}  // namespace marrow::internal::io
