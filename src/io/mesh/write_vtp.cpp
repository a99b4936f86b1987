// Writes VTK XML PolyData: an XML header, then the raw arrays, each after its length in bytes.
#include <array>
#include <cmath>
#include <limits>

#include "writer.h"

namespace marrow::internal::io {
namespace {

// Writes the header elements of the appended arrays and computes their offsets.
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

// A string array: the character codes of each text, terminated by 0.
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

// What the file holds: the surfaces, one after the other.
struct Contents {
    explicit Contents(MeshObjects objects) {
        bool has_colour = false;
        for (const MeshObject& object : objects) {
            points += object.mesh.points.size();
            triangles += object.mesh.triangles.size();
            normals &= !object.mesh.normals.empty();
            has_colour |= object.colour.has_value();
            names.push_back(clean_name(object.name));
        }
        for (const PointArray& array : objects.front().arrays) {
            arrays.push_back(array.name);
            meanings.push_back(array.name + ": " + array.meaning);
        }
        cell_arrays = objects.size() > 1 || has_colour;
    }

    std::uint64_t point_bytes() const { return points * sizeof(Vec3f); }
    std::uint64_t surface_bytes() const { return triangles * sizeof(std::int32_t); }
    std::uint64_t array_bytes() const { return points * sizeof(float); }
    std::uint64_t colour_bytes() const { return triangles * sizeof(Rgb); }

    std::uint64_t points = 0, triangles = 0;
    bool normals = true;       // all surfaces have normals
    bool cell_arrays = false;  // triangles have a surface and a colour
    std::vector<std::string> names;
    std::vector<std::string> arrays, meanings;  // of the points
};

template <class Index>
void write_header(MeshOutput& output, const Contents& contents, const char* index_type) {
    AppendedArrays arrays;
    std::string header = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" ";
    header += "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
    if (output.space != Space::none)
        header += text_array("SPACE", {output.space == Space::RAS ? "RAS" : "LPS"});
    if (contents.cell_arrays) header += text_array("Names", contents.names);
    if (!contents.meanings.empty()) header += text_array("Meanings", contents.meanings);
    header += "</FieldData>\n";
    header += "<Piece NumberOfPoints=\"" + std::to_string(contents.points) + "\" NumberOfVerts=\"0\" ";
    header +=
        "NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(contents.triangles);
    header +=
        "\">\n<Points>\n" + arrays.element("Float32", "Points", 3, contents.point_bytes()) + "</Points>\n";
    if (contents.normals || !contents.arrays.empty()) {
        header += contents.normals ? "<PointData Normals=\"Normals\">\n" : "<PointData>\n";
        if (contents.normals) header += arrays.element("Float32", "Normals", 3, contents.point_bytes());
        for (const std::string& name : contents.arrays)
            header += arrays.element("Float32", name.c_str(), 1, contents.array_bytes());
        header += "</PointData>\n";
    }
    if (contents.cell_arrays) {
        header += "<CellData Scalars=\"Colors\">\n" +
                  arrays.element("Int32", "Surface", 1, contents.surface_bytes());
        header += arrays.element("UInt8", "Colors", 3, contents.colour_bytes()) + "</CellData>\n";
    }
    const std::uint64_t index_bytes = contents.triangles * sizeof(Index);
    header += "<Polys>\n" + arrays.element(index_type, "connectivity", 1, 3 * index_bytes);
    header += arrays.element(index_type, "offsets", 1, index_bytes) + "</Polys>\n";
    output.text(header + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
}

// Writes the appended arrays. Each contains the values of all surfaces, and so does its share of the
// progress.
class ArrayWriter {
  public:
    ArrayWriter(MeshOutput& output, MeshObjects objects, std::size_t arrays)
        : output_(output), objects_(objects), arrays_(arrays) {}

    /// Writes the length of an array and calls `write_part` with the index of each surface.
    template <class WritePart>
    void write(std::uint64_t bytes, const WritePart& write_part) {
        begin_array(output_, bytes);
        for (std::size_t i = 0; i < objects_.size(); ++i) {
            output_.set_share(done_ * objects_.size() + i, arrays_ * objects_.size());
            write_part(objects_[i].mesh, i);
        }
        ++done_;
    }

    void write_vectors(std::uint64_t bytes, std::span<const Vec3f> MeshView::*vectors) {
        write(bytes, [&](const MeshView& mesh, std::size_t) {
            const std::span<const Vec3f> values = mesh.*vectors;
            output_.items<sizeof(Vec3f)>(values.size(), 0, 1, [&](std::size_t i, char* to) {
                return put(to, output_.oriented(values[i]));
            });
        });
    }

  private:
    MeshOutput& output_;
    const MeshObjects objects_;
    const std::size_t arrays_;
    std::size_t done_ = 0;
};

template <class Index>
void write_polydata(MeshOutput& output, MeshObjects objects, const Contents& contents,
                    const char* index_type) {
    write_header<Index>(output, contents, index_type);
    ArrayWriter arrays(
        output, objects,
        3 + contents.arrays.size() + (contents.normals ? 1u : 0u) + (contents.cell_arrays ? 2u : 0u));
    arrays.write_vectors(contents.point_bytes(), &MeshView::points);
    if (contents.normals) arrays.write_vectors(contents.point_bytes(), &MeshView::normals);
    for (std::size_t a = 0; a < contents.arrays.size(); ++a) {
        arrays.write(contents.array_bytes(), [&](const MeshView&, std::size_t surface) {
            const std::span<const float> values = objects[surface].arrays[a].values;
            output.items<sizeof(float)>(values.size(), 0, 1,
                                        [&](std::size_t i, char* to) { return put(to, values[i]); });
        });
    }
    if (contents.cell_arrays) {
        arrays.write(contents.surface_bytes(), [&](const MeshView& mesh, std::size_t surface) {
            output.items<sizeof(std::int32_t)>(mesh.triangles.size(), 0, 1, [&](std::size_t, char* to) {
                return put(to, static_cast<std::int32_t>(surface));
            });
        });
        arrays.write(contents.colour_bytes(), [&](const MeshView& mesh, std::size_t surface) {
            const Rgb colour = rgb(objects[surface]);
            output.items<sizeof(Rgb)>(mesh.triangles.size(), 0, 1,
                                      [&](std::size_t, char* to) { return put(to, colour); });
        });
    }
    const std::uint64_t index_bytes = contents.triangles * sizeof(Index);
    std::uint64_t first_point = 0, first_triangle = 0;
    arrays.write(3 * index_bytes, [&](const MeshView& mesh, std::size_t) {
        output.items<3 * sizeof(Index)>(mesh.triangles.size(), 0, 1, [&](std::size_t i, char* to) {
            for (const std::uint32_t corner : mesh.triangles[i])
                to = put(to, static_cast<Index>(first_point + corner));
            return to;
        });
        first_point += mesh.points.size();
    });
    // The offsets: where the corners of each triangle end in the connectivity.
    arrays.write(index_bytes, [&](const MeshView& mesh, std::size_t) {
        output.items<sizeof(Index)>(mesh.triangles.size(), 0, 1, [&](std::size_t i, char* to) {
            return put(to, static_cast<Index>(3 * (first_triangle + i + 1)));
        });
        first_triangle += mesh.triangles.size();
    });
    output.text("\n</AppendedData>\n</VTKFile>\n");
}

}  // namespace

void write_vtp(MeshOutput& output, MeshObjects objects) {
    constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
    const Contents contents(objects);
    if (contents.points <= kMost && contents.triangles <= kMost / 3)
        write_polydata<std::int32_t>(output, objects, contents, "Int32");
    else
        write_polydata<std::int64_t>(output, objects, contents, "Int64");
}

}  // namespace marrow::internal::io
