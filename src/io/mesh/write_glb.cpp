// Writes binary glTF 2.0: a header, a JSON description of the buffer, and the buffer.
#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include <marrow/error.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

using Json = nlohmann::ordered_json;

// Converts from millimetres in LPS to glTF: metres, y up, front at +z, left at +x.
Vec3f direction(const Vec3f& v) {
    return {v[0], v[2], -v[1]};
}
Vec3f position(const Vec3f& p) {
    const Vec3f q = direction(p);
    return {static_cast<float>(q[0] / 1000.0), static_cast<float>(q[1] / 1000.0),
            static_cast<float>(q[2] / 1000.0)};
}

// Colours in glTF are linear, not sRGB.
Vec3f linear(const std::array<double, 3>& colour) {
    Vec3f result{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double c = std::clamp(colour[i], 0.0, 1.0);
        result[i] = static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    return result;
}

// A colour of a point. The fourth byte is the opacity; without it, colours would not be aligned.
using LinearRgba = std::array<std::uint8_t, 4>;

LinearRgba linear_rgba(const Rgb8& colour) {
    const Vec3f c = linear({colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0});
    LinearRgba result{0, 0, 0, 255};
    for (std::size_t i = 0; i < 3; ++i) result[i] = static_cast<std::uint8_t>(std::lround(255 * c[i]));
    return result;
}

// The JSON description of the buffer, and the size of the buffer. It holds points, normals and triangles of
// each object.
class Description {
  public:
    Description(MeshObjects objects, Space space) {
        Json asset{{"version", "2.0"}, {"generator", "Marrow"}};
        if (space == Space::none) asset["extras"] = {{"space", "none"}};
        json_ = {{"asset", asset}, {"scene", 0}};
        for (const MeshObject& object : objects) {
            Json node = named(object);
            node["mesh"] = add("meshes", mesh(object));
            json_["scenes"][0]["nodes"].push_back(add("nodes", node));
        }
        json_["buffers"] = {{{"byteLength", bytes_}}};
    }

    // Padded to a multiple of four bytes.
    std::string json() const {
        std::string text = json_.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        return text;
    }
    std::uint64_t buffer_bytes() const { return bytes_; }

  private:
    static constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedByte = 5121, kVertices = 34962,
                         kIndices = 34963;

    // Adds an element to a list, and returns its index.
    std::size_t add(const char* list, Json element) {
        json_[list].push_back(std::move(element));
        return json_[list].size() - 1;
    }

    // Adds an accessor for the next `count` elements of the buffer.
    std::size_t add_accessor(std::uint64_t count, std::uint64_t bytes, int target, int component,
                             const char* type, const Json& more = Json::object()) {
        Json accessor{
            {"bufferView",
             add("bufferViews",
                 {{"buffer", 0}, {"byteOffset", bytes_}, {"byteLength", bytes}, {"target", target}})},
            {"componentType", component},
            {"count", count},
            {"type", type}};
        accessor.update(more);
        bytes_ += bytes;
        return add("accessors", std::move(accessor));
    }

    static Json named(const MeshObject& object) {
        Json json = Json::object();
        if (!object.name.empty()) json["name"] = clean_name(object.name);
        return json;
    }

    Json mesh(const MeshObject& object) {
        const auto& [points, normals, triangles] = object.mesh;
        Vec3f lower = position(points.front()), upper = lower;
        for (const Vec3f& point : points) {
            const Vec3f p = position(point);
            for (std::size_t a = 0; a < 3; ++a) {
                lower[a] = std::min(lower[a], p[a]);
                upper[a] = std::max(upper[a], p[a]);
            }
        }
        const std::uint64_t point_bytes = points.size() * sizeof(Vec3f),
                            corners = 3 * std::uint64_t{triangles.size()};
        Json primitive;
        primitive["attributes"]["POSITION"] = add_accessor(points.size(), point_bytes, kVertices, kFloat,
                                                           "VEC3", {{"min", lower}, {"max", upper}});
        if (!normals.empty())
            primitive["attributes"]["NORMAL"] =
                add_accessor(normals.size(), point_bytes, kVertices, kFloat, "VEC3");
        if (!object.point_colours.empty())
            primitive["attributes"]["COLOR_0"] =
                add_accessor(points.size(), points.size() * sizeof(LinearRgba), kVertices, kUnsignedByte,
                             "VEC4", {{"normalized", true}});
        primitive["indices"] =
            add_accessor(corners, corners * sizeof(std::uint32_t), kIndices, kUnsignedInt, "SCALAR");
        if (object.point_colours.empty() && object.colour) {
            const Vec3f c = linear(*object.colour);
            Json material = named(object);
            material["pbrMetallicRoughness"] = {
                {"baseColorFactor", {c[0], c[1], c[2], 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.6}};
            primitive["material"] = add("materials", std::move(material));
        }
        Json result = named(object);
        result["primitives"].push_back(std::move(primitive));
        return result;
    }

    Json json_;
    std::uint64_t bytes_ = 0;
};

std::string little_endian_words(std::initializer_list<std::uint64_t> values) {
    std::string bytes(4 * values.size(), '\0');
    char* to = bytes.data();
    for (const std::uint64_t value : values) to = put(to, static_cast<std::uint32_t>(value));
    return bytes;
}

}  // namespace

void write_glb(MeshOutput& output, MeshObjects objects) {
    constexpr std::uint64_t kMagic = 0x46546C67, kJson = 0x4E4F534A,
                            kBinary = 0x004E4942;  // "glTF", "JSON", "BIN\0"
    const Description description(objects, output.space);
    const std::string json = description.json();
    const std::uint64_t buffer = description.buffer_bytes(), total = 12 + 8 + json.size() + 8 + buffer;
    if (total > std::numeric_limits<std::uint32_t>::max())
        throw LimitError("a .glb file holds at most 4 GiB, and these surfaces need " +
                         std::to_string(total >> 20) + " MiB; write .ply or .vtp");
    output.text(little_endian_words({kMagic, 2, total, json.size(), kJson}) + json +
                little_endian_words({buffer, kBinary}));
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const MeshView& mesh = objects[i].mesh;
        output.set_share(i, objects.size());
        output.items<sizeof(Vec3f)>(mesh.points.size(), 0, 0.4, [&](std::size_t k, char* to) {
            return put(to, position(mesh.points[k]));
        });
        output.items<sizeof(Vec3f)>(mesh.normals.size(), 0.4, 0.7, [&](std::size_t k, char* to) {
            return put(to, direction(mesh.normals[k]));
        });
        const std::span<const Rgb8> colours = objects[i].point_colours;
        output.items<sizeof(LinearRgba)>(colours.size(), 0.7, 0.8, [&](std::size_t k, char* to) {
            return put(to, linear_rgba(colours[k]));
        });
        output.items<sizeof(Triangle)>(mesh.triangles.size(), 0.8, 1,
                                       [&](std::size_t k, char* to) { return put(to, mesh.triangles[k]); });
    }
}

}  // namespace marrow::internal::io
