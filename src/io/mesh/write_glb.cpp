// Writes binary glTF 2.0: a header, a JSON description of the buffer, and the buffer.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/error.h>

#include "writer.h"

namespace marrow::internal::io {
namespace {

// Converts from millimetres in LPS to glTF: metres, y up, front at +z, left at +x.
Vec3f direction(const Vec3f& v) {
    return {v[0], v[2], -v[1]};
}
Vec3f position(const Vec3f& p) {
    const Vec3f q = direction(p);
    return {static_cast<float>(q[0] / 1000.0), static_cast<float>(q[1] / 1000.0),
            static_cast<float>(q[2] / 1000.0)};
}

std::string list(const Vec3f& v) {  // fmt writes the fewest digits that read back, in any locale
    return fmt::format("[{},{},{}]", v[0], v[1], v[2]);
}

std::string json_string(const std::string& name) {
    std::string text = "\"";
    for (const char c : clean_name(name)) {
        if (c == '"' || c == '\\') text += '\\';
        text += c;
    }
    return text + "\"";
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

// A growing JSON array of objects.
class Array {
  public:
    std::uint64_t add(std::string_view object) {
        if (size_ > 0) text_ += ',';
        text_ += object;
        return size_++;
    }
    std::string member(const char* name) const {
        return size_ > 0 ? fmt::format(",\"{}\":[{}]", name, text_) : "";
    }

  private:
    std::string text_;
    std::uint64_t size_ = 0;
};

// The JSON description of the buffer, and the size of the buffer. It holds points, normals and triangles of
// each object.
class Description {
  public:
    Description(MeshObjects objects, Space space) {
        std::string scene;
        for (const MeshObject& object : objects) {
            const std::uint64_t mesh = add_mesh(object);
            const std::uint64_t node =
                nodes_.add(fmt::format("{{{}\"mesh\":{}}}", name_member(object), mesh));
            if (!scene.empty()) scene += ',';
            scene += std::to_string(node);
        }
        json_ = fmt::format(
            "{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"Marrow\"{}}},\"scene\":0,\"scenes\":[{{"
            "\"nodes\":[{}]}}]"
            "{}{}{}{}{},\"buffers\":[{{\"byteLength\":{}}}]}}",
            space == Space::none ? ",\"extras\":{\"space\":\"none\"}" : "", scene, nodes_.member("nodes"),
            meshes_.member("meshes"), materials_.member("materials"), accessors_.member("accessors"),
            views_.member("bufferViews"), bytes_);
        json_.resize((json_.size() + 3) / 4 * 4, ' ');
    }

    const std::string& json() const { return json_; }
    std::uint64_t buffer_bytes() const { return bytes_; }

  private:
    static constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertices = 34962, kIndices = 34963;

    // Adds an accessor for the next `count` elements of the buffer.
    std::uint64_t add_accessor(std::uint64_t count, std::uint64_t bytes, int target, int component,
                               const char* type, const std::string& more) {
        const std::uint64_t view = views_.add(fmt::format(
            "{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{},\"target\":{}}}", bytes_, bytes, target));
        bytes_ += bytes;
        return accessors_.add(
            fmt::format("{{\"bufferView\":{},\"componentType\":{},\"count\":{},\"type\":\"{}\"{}}}", view,
                        component, count, type, more));
    }

    static std::string name_member(const MeshObject& object) {
        return object.name.empty() ? "" : fmt::format("\"name\":{},", json_string(object.name));
    }

    std::uint64_t add_mesh(const MeshObject& object) {
        const auto& [points, normals, triangles] = object.mesh;
        if (points.empty() || triangles.empty())
            throw InputError("a .glb file cannot hold a surface without triangles");
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
        std::string attributes = fmt::format(
            "\"POSITION\":{}", add_accessor(points.size(), point_bytes, kVertices, kFloat, "VEC3",
                                            fmt::format(",\"min\":{},\"max\":{}", list(lower), list(upper))));
        if (!normals.empty())
            attributes += fmt::format(
                ",\"NORMAL\":{}", add_accessor(normals.size(), point_bytes, kVertices, kFloat, "VEC3", ""));
        const std::uint64_t indices =
            add_accessor(corners, corners * sizeof(std::uint32_t), kIndices, kUnsignedInt, "SCALAR", "");
        std::string material;
        if (object.colour) {
            const Vec3f c = linear(*object.colour);
            material = fmt::format(
                ",\"material\":{}",
                materials_.add(fmt::format("{{{}\"pbrMetallicRoughness\":{{\"baseColorFactor\":[{},{},{},1],"
                                           "\"metallicFactor\":0,\"roughnessFactor\":0.6}}}}",
                                           name_member(object), c[0], c[1], c[2])));
        }
        return meshes_.add(fmt::format("{{{}\"primitives\":[{{\"attributes\":{{{}}},\"indices\":{}{}}}]}}",
                                       name_member(object), attributes, indices, material));
    }

    Array nodes_, meshes_, materials_, accessors_, views_;
    std::uint64_t bytes_ = 0;
    std::string json_;
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
    const std::string& json = description.json();
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
        output.items<sizeof(Triangle)>(mesh.triangles.size(), 0.7, 1,
                                       [&](std::size_t k, char* to) { return put(to, mesh.triangles[k]); });
    }
}

}  // namespace marrow::internal::io
