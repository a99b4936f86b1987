// Writes binary STL: an 80-byte header, the number of triangles, and for each triangle its normal, three
// points and two unused bytes.
#include <limits>

#include <marrow/vector.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

// Zero for a triangle without area, as the format requires.
Vec3f facet_normal(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3d n = cross(to_double(b) - to_double(a), to_double(c) - to_double(a));
    const double size = length(n);
    return size == 0 ? Vec3f{0, 0, 0} : Vec3f(to_float({n[0] / size, n[1] / size, n[2] / size}));
}

}  // namespace

void write_stl_header(MeshOutput& output, std::uint64_t triangles) {
    if (triangles > std::numeric_limits<std::uint32_t>::max())
        throw LimitError("an STL file holds at most 4294967295 triangles, and this mesh has " +
                         std::to_string(triangles) + "; write .ply or .vtp");
    // The header must not start with "solid", which marks the text format.
    std::string header = "Marrow " + space_mark(output.space);
    header.resize(80, ' ');
    char count[4];
    put(count, static_cast<std::uint32_t>(triangles));
    output.text(header.append(count, sizeof count));
}

void write_stl_facets(MeshOutput& output, const SurfacePart& part) {
    output.items<kStlFacetBytes>(part.triangles.size(), 0, 1, [&](std::size_t i, char* to) {
        const Triangle& t = part.triangles[i];
        const auto corner = [&](std::uint32_t point) {
            return output.oriented(part.points[static_cast<std::size_t>(point - part.first_point)]);
        };
        const Vec3f a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
        to = put(to, facet_normal(a, b, c));
        to = put(put(put(to, a), b), c);
        return put(to, std::uint16_t{0});
    });
}

}  // namespace marrow::internal::io
