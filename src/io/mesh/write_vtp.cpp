// Writes VTK XML PolyData: an XML header, then the raw arrays, each after its length in bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

// Arrays with an item for each point or triangle of all surfaces. Each is an element of the header; the items
// follow after the header.
class AppendedArrays {
  public:
    AppendedArrays(MeshOutput& output, MeshObjects objects) : output_(output), objects_(objects) {}

    // Adds an array and returns its element. `count(mesh)` is the number of a surface's items, and
    // `item(surface, i)` is one of them.
    template <class Count, class Item>
    std::string add(const char* type, const char* name, int components, Count count, Item item) {
        constexpr std::size_t kItem = sizeof(item(std::size_t{}, std::size_t{}));
        std::uint64_t bytes = 0;
        for (const MeshObject& object : objects_) bytes += kItem * count(object.mesh);
        const std::string element = fmt::format(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
            "offset=\"{}\"/>\n",
            type, name, components, offset_);
        offset_ += sizeof bytes + bytes;
        writers_.push_back([this, bytes, count, item](std::size_t array) {
            char length[sizeof bytes];
            put(length, bytes);
            output_.text(std::string(length, sizeof length));
            for (std::size_t s = 0; s < objects_.size(); ++s) {
                output_.set_share(array * objects_.size() + s, writers_.size() * objects_.size());
                output_.items<kItem>(count(objects_[s].mesh), 0, 1,
                                     [&](std::size_t i, char* to) { return put(to, item(s, i)); });
            }
        });
        return element;
    }

    void write() const {
        for (std::size_t array = 0; array < writers_.size(); ++array) writers_[array](array);
    }

  private:
    MeshOutput& output_;
    const MeshObjects objects_;
    std::uint64_t offset_ = 0;
    std::vector<std::function<void(std::size_t array)>> writers_;
};

// A string array: the character codes of each text, terminated by 0.
std::string text_array(const char* name, const std::vector<std::string>& texts) {
    std::string array = fmt::format(
        "<DataArray type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">", name, texts.size());
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
            first_point.push_back(points);
            first_triangle.push_back(triangles);
            points += object.mesh.points.size();
            triangles += object.mesh.triangles.size();
            normals &= !object.mesh.normals.empty();
            has_colour |= object.colour.has_value();
            names.push_back(clean_name(object.name));
            colours.push_back(rgb(object));
        }
        for (std::size_t k = 0; k < objects.front().arrays.size(); ++k) add_meanings(objects, k);
        cell_arrays = objects.size() > 1 || has_colour;
    }

    // The meaning of an array, or one for each surface if they differ.
    void add_meanings(MeshObjects objects, std::size_t k) {
        const PointArray& array = objects.front().arrays[k];
        const bool same = std::all_of(objects.begin(), objects.end(), [&](const MeshObject& object) {
            return object.arrays[k].meaning == array.meaning;
        });
        if (same) return meanings.push_back(array.name + ": " + array.meaning);
        for (std::size_t i = 0; i < objects.size(); ++i)
            meanings.push_back(names[i] + ", " + array.name + ": " + objects[i].arrays[k].meaning);
    }

    std::uint64_t points = 0, triangles = 0;
    bool normals = true;       // all surfaces have normals
    bool cell_arrays = false;  // triangles have a surface and a colour
    // An element for each surface.
    std::vector<std::uint64_t> first_point, first_triangle;
    std::vector<std::string> names;
    std::vector<Rgb> colours;
    std::vector<std::string> meanings;  // of the arrays of the points
};

template <class Index>
void write_polydata(MeshOutput& output, MeshObjects objects, const Contents& contents,
                    const char* index_type) {
    const auto points = [](const MeshView& mesh) { return mesh.points.size(); };
    const auto triangles = [](const MeshView& mesh) { return mesh.triangles.size(); };
    AppendedArrays arrays(output, objects);
    std::string header =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
    if (output.space != Space::none)
        header += text_array("SPACE", {output.space == Space::RAS ? "RAS" : "LPS"});
    if (contents.cell_arrays) header += text_array("Names", contents.names);
    if (!contents.meanings.empty()) header += text_array("Meanings", contents.meanings);
    header += fmt::format(
        "</FieldData>\n<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
        "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n<Points>\n",
        contents.points, contents.triangles);
    header += arrays.add("Float32", "Points", 3, points, [&](std::size_t s, std::size_t i) {
        return output.oriented(objects[s].mesh.points[i]);
    });
    header += "</Points>\n";
    if (contents.normals || !contents.meanings.empty()) {
        header += contents.normals ? "<PointData Normals=\"Normals\">\n" : "<PointData>\n";
        if (contents.normals) {
            header += arrays.add("Float32", "Normals", 3, points, [&](std::size_t s, std::size_t i) {
                return output.oriented(objects[s].mesh.normals[i]);
            });
        }
        for (std::size_t a = 0; a < objects.front().arrays.size(); ++a) {
            header += arrays.add(
                "Float32", objects.front().arrays[a].name.c_str(), 1, points,
                [&objects, a](std::size_t s, std::size_t i) { return objects[s].arrays[a].values[i]; });
        }
        header += "</PointData>\n";
    }
    if (contents.cell_arrays) {
        header += "<CellData Scalars=\"Colors\">\n";
        header += arrays.add("Int32", "Surface", 1, triangles,
                             [](std::size_t s, std::size_t) { return static_cast<std::int32_t>(s); });
        header += arrays.add("UInt8", "Colors", 3, triangles,
                             [&](std::size_t s, std::size_t) { return contents.colours[s]; });
        header += "</CellData>\n";
    }
    header += "<Polys>\n";
    header += arrays.add(index_type, "connectivity", 1, triangles, [&](std::size_t s, std::size_t i) {
        std::array<Index, 3> corners;
        for (std::size_t c = 0; c < 3; ++c)
            corners[c] = static_cast<Index>(contents.first_point[s] + objects[s].mesh.triangles[i][c]);
        return corners;
    });
    // Where the corners of each triangle end in the connectivity.
    header += arrays.add(index_type, "offsets", 1, triangles, [&](std::size_t s, std::size_t i) {
        return static_cast<Index>(3 * (contents.first_triangle[s] + i + 1));
    });
    output.text(header + "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
    arrays.write();
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
