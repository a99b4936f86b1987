// VTK XML PolyData: an XML header, then the arrays as they lie in memory, each after its length in bytes.
#include <limits>

#include "mesh_output.h"

namespace marrow {
namespace {

// Names the arrays in the header and keeps count of where each will lie.
class AppendedArrays {
  public:
    std::string element(const char* type, const char* name, int components, std::uint64_t bytes) {
        std::string text = std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
                           "\" NumberOfComponents=\"" + std::to_string(components) +
                           "\" format=\"appended\" offset=\"" + std::to_string(offset_) + "\"/>\n";
        offset_ += sizeof bytes + bytes;
        return text;
    }

  private:
    std::uint64_t offset_ = 0;
};

void begin_array(MeshOutput& output, std::uint64_t bytes) {
    char length[sizeof bytes];
    put(length, bytes);
    output.text(std::string(length, sizeof length));
}

template <class Index>
void write_arrays(MeshOutput& output, const Mesh& mesh, const char* index_type) {
    const auto& points = mesh.points;
    const auto& normals = mesh.normals;
    const auto& triangles = mesh.triangles;
    const std::uint64_t point_bytes = points.size() * sizeof(Vec3f);
    const std::uint64_t normal_bytes = normals.size() * sizeof(Vec3f);
    const std::uint64_t corner_bytes = triangles.size() * 3 * sizeof(Index);
    const std::uint64_t end_bytes = triangles.size() * sizeof(Index);

    AppendedArrays arrays;
    std::string header = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" ";
    header += "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n";
    // Text in an ASCII array is a list of character codes, ended by 0.
    header += "<FieldData><DataArray type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">";
    for (const char c : output.space == Space::RAS ? "RAS" : "LPS") header += std::to_string(int(c)) + " ";
    header += "</DataArray></FieldData>\n";
    header += "<Piece NumberOfPoints=\"" + std::to_string(points.size()) + "\" NumberOfVerts=\"0\" ";
    header += "NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(triangles.size());
    header += "\">\n<Points>\n" + arrays.element("Float32", "Points", 3, point_bytes) + "</Points>\n";
    if (!normals.empty())
        header += "<PointData Normals=\"Normals\">\n" +
                  arrays.element("Float32", "Normals", 3, normal_bytes) + "</PointData>\n";
    header += "<Polys>\n" + arrays.element(index_type, "connectivity", 1, corner_bytes);
    header += arrays.element(index_type, "offsets", 1, end_bytes) + "</Polys>\n";
    output.text(header + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");

    begin_array(output, point_bytes);
    output.items<sizeof(Vec3f)>(points.size(), 0, 0.3,
                                [&](std::size_t i, char* to) { return put(to, output.oriented(points[i])); });
    if (!normals.empty()) begin_array(output, normal_bytes);
    output.items<sizeof(Vec3f)>(normals.size(), 0.3, 0.6, [&](std::size_t i, char* to) {
        return put(to, output.oriented(normals[i]));
    });
    begin_array(output, corner_bytes);
    output.items<3 * sizeof(Index)>(triangles.size(), 0.6, 0.9, [&](std::size_t i, char* to) {
        for (const std::uint32_t corner : triangles[i]) to = put(to, static_cast<Index>(corner));
        return to;
    });
    begin_array(output, end_bytes);  // where each triangle's corners end in the connectivity
    output.items<sizeof(Index)>(triangles.size(), 0.9, 1, [&](std::size_t i, char* to) {
        return put(to, static_cast<Index>(3 * (i + 1)));
    });
    output.text("\n</AppendedData>\n</VTKFile>\n");
}

}  // namespace

void write_vtp(MeshOutput& output, const Mesh& mesh) {
    constexpr std::size_t int32_max = std::numeric_limits<std::int32_t>::max();
    if (mesh.points.size() <= int32_max && mesh.triangles.size() <= int32_max / 3)
        write_arrays<std::int32_t>(output, mesh, "Int32");
    else
        write_arrays<std::int64_t>(output, mesh, "Int64");
}

}  // namespace marrow
