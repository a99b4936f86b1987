// VTK XML PolyData: an XML header, then the arrays as they lie in memory, each after its length in bytes.
#include <array>
#include <cmath>
#include <limits>

#include "writer.h"

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

// An array of text: each as its character codes, ended by 0.
std::string text_array(const char* name, const std::vector<std::string>& texts) {
    std::string array = std::string("<DataArray type=\"String\" Name=\"") + name + "\" NumberOfTuples=\"" +
                        std::to_string(texts.size()) + "\" format=\"ascii\">";
    for (const std::string& text : texts) {
        for (const char c : text) array += std::to_string(static_cast<unsigned char>(c)) + " ";
        array += "0 ";
    }
    return array + "</DataArray>\n";
}

using Rgb = std::array<std::uint8_t, 3>;

Rgb rgb(const MeshObject& object) {
    constexpr std::array<double, 3> kGrey{0.8, 0.8, 0.8};
    Rgb result{};
    for (std::size_t i = 0; i < 3; ++i)
        result[i] = static_cast<std::uint8_t>(
            std::lround(255 * std::clamp(object.colour.value_or(kGrey)[i], 0.0, 1.0)));
    return result;
}

// All surfaces as one, one after the other.
template <class Index>
void write_arrays(MeshOutput& output, MeshObjects objects, const char* index_type) {
    std::uint64_t points = 0, triangles = 0;
    bool normals = true, has_colour = false;
    std::vector<std::string> names;
    for (const MeshObject& object : objects) {
        points += object.mesh->points.size();
        triangles += object.mesh->triangles.size();
        normals &= !object.mesh->normals.empty();
        has_colour |= object.colour.has_value();
        names.push_back(clean_name(object.name));
    }
    const bool apart = objects.size() > 1 || has_colour;
    const std::uint64_t point_bytes = points * sizeof(Vec3f);
    const std::uint64_t corner_bytes = triangles * 3 * sizeof(Index);
    const std::uint64_t end_bytes = triangles * sizeof(Index);
    const std::uint64_t surface_bytes = triangles * sizeof(std::int32_t);
    const std::uint64_t colour_bytes = triangles * sizeof(Rgb);

    AppendedArrays arrays;
    std::string header = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" ";
    header += "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
    if (output.space != Space::none)
        header += text_array("SPACE", {output.space == Space::RAS ? "RAS" : "LPS"});
    if (apart) header += text_array("Names", names);
    header += "</FieldData>\n";
    header += "<Piece NumberOfPoints=\"" + std::to_string(points) + "\" NumberOfVerts=\"0\" ";
    header += "NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(triangles);
    header += "\">\n<Points>\n" + arrays.element("Float32", "Points", 3, point_bytes) + "</Points>\n";
    if (normals)
        header += "<PointData Normals=\"Normals\">\n" + arrays.element("Float32", "Normals", 3, point_bytes) +
                  "</PointData>\n";
    if (apart) {
        header += "<CellData Scalars=\"Colors\">\n" + arrays.element("Int32", "Surface", 1, surface_bytes);
        header += arrays.element("UInt8", "Colors", 3, colour_bytes) + "</CellData>\n";
    }
    header += "<Polys>\n" + arrays.element(index_type, "connectivity", 1, corner_bytes);
    header += arrays.element(index_type, "offsets", 1, end_bytes) + "</Polys>\n";
    output.text(header + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");

    // Each array runs through all surfaces; so does the progress.
    std::size_t arrays_done = 0;
    const std::size_t array_count = 3 + (normals ? 1u : 0u) + (apart ? 2u : 0u);
    const auto each = [&](std::uint64_t bytes, const auto& write) {
        begin_array(output, bytes);
        for (std::size_t i = 0; i < objects.size(); ++i) {
            output.set_share(arrays_done * objects.size() + i, array_count * objects.size());
            write(*objects[i].mesh, i);
        }
        ++arrays_done;
    };
    each(point_bytes, [&](const Mesh& mesh, std::size_t) {
        output.items<sizeof(Vec3f)>(mesh.points.size(), 0, 1, [&](std::size_t i, char* to) {
            return put(to, output.oriented(mesh.points[i]));
        });
    });
    if (normals) {
        each(point_bytes, [&](const Mesh& mesh, std::size_t) {
            output.items<sizeof(Vec3f)>(mesh.normals.size(), 0, 1, [&](std::size_t i, char* to) {
                return put(to, output.oriented(mesh.normals[i]));
            });
        });
    }
    if (apart) {
        each(surface_bytes, [&](const Mesh& mesh, std::size_t surface) {
            output.items<sizeof(std::int32_t)>(mesh.triangles.size(), 0, 1, [&](std::size_t, char* to) {
                return put(to, static_cast<std::int32_t>(surface));
            });
        });
        each(colour_bytes, [&](const Mesh& mesh, std::size_t surface) {
            const Rgb colour = rgb(objects[surface]);
            output.items<sizeof(Rgb)>(mesh.triangles.size(), 0, 1,
                                      [&](std::size_t, char* to) { return put(to, colour); });
        });
    }
    std::uint64_t first_point = 0, first_triangle = 0;
    each(corner_bytes, [&](const Mesh& mesh, std::size_t) {
        output.items<3 * sizeof(Index)>(mesh.triangles.size(), 0, 1, [&](std::size_t i, char* to) {
            for (const std::uint32_t corner : mesh.triangles[i])
                to = put(to, static_cast<Index>(first_point + corner));
            return to;
        });
        first_point += mesh.points.size();
    });
    each(end_bytes,
         [&](const Mesh& mesh, std::size_t) {  // where each triangle's corners end in the connectivity
             output.items<sizeof(Index)>(mesh.triangles.size(), 0, 1, [&](std::size_t i, char* to) {
                 return put(to, static_cast<Index>(3 * (first_triangle + i + 1)));
             });
             first_triangle += mesh.triangles.size();
         });
    output.text("\n</AppendedData>\n</VTKFile>\n");
}

}  // namespace

void write_vtp(MeshOutput& output, MeshObjects objects) {
    constexpr std::uint64_t int32_max = std::numeric_limits<std::int32_t>::max();
    std::uint64_t points = 0, triangles = 0;
    for (const MeshObject& object : objects) {
        points += object.mesh->points.size();
        triangles += object.mesh->triangles.size();
    }
    if (points <= int32_max && triangles <= int32_max / 3)
        write_arrays<std::int32_t>(output, objects, "Int32");
    else
        write_arrays<std::int64_t>(output, objects, "Int64");
}

}  // namespace marrow
