// Writes binary little-endian PLY: a text header describes the records after it.
#include <limits>

#include "writer.h"

namespace marrow::internal::io {

std::string ply_header(Space space, std::uint64_t points, bool normals, std::uint64_t triangles,
                       std::span<const PointArray> arrays) {
    const bool signed_indices = points <= std::numeric_limits<std::int32_t>::max();
    std::string header = "ply\nformat binary_little_endian 1.0\n";
    header += "comment Marrow " + space_mark(space) + "\n";
    for (const PointArray& array : arrays) header += "comment " + array.name + ": " + array.meaning + "\n";
    header += "element vertex " + std::to_string(points) + "\n";
    header += "property float x\nproperty float y\nproperty float z\n";
    if (normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
    for (const PointArray& array : arrays) header += "property float " + array.name + "\n";
    header += "element face " + std::to_string(triangles) + "\n";
    header += std::string("property list uchar ") + (signed_indices ? "int" : "uint") + " vertex_indices\n";
    return header + "end_header\n";
}

void write_ply_points(MeshOutput& output, const SurfacePart& part, std::span<const PointArray> arrays) {
    constexpr std::size_t kMostBytes = ply_point_bytes(true) + kMostPointArrays * sizeof(float);
    output.items<kMostBytes>(part.points.size(), 0, 0.5, [&](std::size_t i, char* to) {
        to = put(to, output.oriented(part.points[i]));
        if (!part.normals.empty()) to = put(to, output.oriented(part.normals[i]));
        for (const PointArray& array : arrays) to = put(to, array.values[i]);
        return to;
    });
}

void write_ply_faces(MeshOutput& output, const SurfacePart& part) {
    output.items<kPlyFaceBytes>(part.triangles.size(), 0.5, 1, [&](std::size_t i, char* to) {
        return put(put(to, std::uint8_t{3}), part.triangles[i]);
    });
}

}  // namespace marrow::internal::io
