// Binary little-endian PLY: a text header that describes the records after it.
#include <limits>

#include "mesh_output.h"

namespace marrow {

void write_ply(MeshOutput& output) {
    const auto& points = output.mesh.points;
    const auto& normals = output.mesh.normals;
    const auto& triangles = output.mesh.triangles;
    const bool signed_indices = points.size() <= std::numeric_limits<std::int32_t>::max();

    std::string header = "ply\nformat binary_little_endian 1.0\n";
    header += "comment Marrow " + space_mark(output.space) + "\n";
    header += "element vertex " + std::to_string(points.size()) + "\n";
    header += "property float x\nproperty float y\nproperty float z\n";
    if (!normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
    header += "element face " + std::to_string(triangles.size()) + "\n";
    header += std::string("property list uchar ") + (signed_indices ? "int" : "uint") + " vertex_indices\n";
    output.text(header + "end_header\n");

    output.items<24>(points.size(), 0, 0.5, [&](std::size_t i, char* to) {
        to = put(to, output.oriented(points[i]));
        return normals.empty() ? to : put(to, output.oriented(normals[i]));
    });
    output.items<13>(triangles.size(), 0.5, 1,
                     [&](std::size_t i, char* to) { return put(put(to, std::uint8_t{3}), triangles[i]); });
}

}  // namespace marrow
