// Reads binary glTF 2.0: a header, a JSON description, and a buffer. Only a flat scene of triangles without
// transforms is supported, as Marrow writes it.
#include <cstring>
#include <limits>
#include <map>

#include "io/bytes/json.h"
#include "io/bytes/text.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

using Json = nlohmann::json;

// Converts from glTF (metres, y up, front at +z) to millimetres in LPS.
Vec3f position(const Vec3f& p) {
    return {static_cast<float>(p[0] * 1000.0), static_cast<float>(p[2] * -1000.0),
            static_cast<float>(p[1] * 1000.0)};
}

// The elements of an accessor, which are inside the buffer.
struct Elements {
    const char* begin = nullptr;
    std::uint64_t count = 0, stride = 0;
    std::uint64_t component_type = 0;
};

class GlbReader {
  public:
    GlbReader(const FileContent& input, std::vector<ObjectStart>& objects, const Progress& progress)
        : input_(input), objects_(objects), reading_(progress) {
        constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;
        if (input.bytes.size() < 20 || word(0) != kMagic) input.refuse("is not a .glb file");
        if (word(4) != 2)
            input.refuse("is glTF version " + std::to_string(word(4)) + "; only version 2 is supported");
        if (word(8) < 20 || word(8) > input.bytes.size() || word(16) != kJson)
            input.refuse("the file is cut off");
        const std::string_view all = std::string_view(input.bytes).substr(0, word(8));
        const auto chunk = [&](std::uint64_t at) {  // without its header
            const std::uint64_t size = word(at);
            if (size > all.size() - at - 8) input.refuse("the file is cut off");
            return all.substr(at + 8, size);
        };
        const std::string_view text = chunk(12);
        json_ = parse_json_object(text, [&](const char* why) { input.refuse(why); });
        const std::uint64_t next = 20 + text.size();
        if (all.size() >= next + 8 && word(next + 4) == kBinary) buffer_ = chunk(next);
    }

    Mesh read() {
        for (const Json& needed : list(json_, "extensionsRequired"))
            input_.refuse("needs an unsupported glTF extension: " +
                          quoted(needed.is_string() ? needed.get<std::string>() : "?"));
        const Json& scene = element("scenes", number(json_, "scene", 0));
        for (const Json& index : list(scene, "nodes")) add_node(element("nodes", number(index)));
        if (mesh_.triangles.empty()) input_.refuse("its scene shows no triangles");
        return std::move(mesh_);
    }

    // Terrain is not in a patient's space.
    bool names_no_space() const {
        return member(member(member(json_, "asset"), "extras"), "space") == "none";
    }

  private:
    std::uint32_t word(std::uint64_t at) const {
        std::uint32_t value = 0;
        std::memcpy(&value, input_.bytes.data() + at, sizeof value);
        return value;
    }

    // A member of an object, or null.
    static const Json& member(const Json& object, const char* name) {
        static const Json kNull;
        const auto at = object.is_object() ? object.find(name) : object.end();
        return at == object.end() ? kNull : *at;
    }
    // The elements of a list; empty if it is missing.
    const Json& list(const Json& object, const char* name) const {
        static const Json kEmpty = Json::array();
        const Json& found = member(object, name);
        return found.is_array() ? found : kEmpty;
    }
    // A count or an offset; a file has at most 4 GiB.
    std::uint64_t number(const Json& value) const {
        if (!value.is_number_unsigned() ||
            value.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
            input_.refuse("its description lacks a number, or has an invalid one");
        return value.get<std::uint64_t>();
    }
    std::uint64_t number(const Json& object, const char* name, std::optional<std::uint64_t> otherwise) const {
        const Json& value = member(object, name);
        return value.is_null() && otherwise ? *otherwise : number(value);
    }
    const Json& element(const char* name, std::uint64_t index) const {
        const Json& all = list(json_, name);
        if (index >= all.size()) input_.refuse("names a missing element of its " + std::string(name));
        return all[index];
    }

    void add_node(const Json& node) {
        if (!list(node, "children").empty()) input_.refuse("has nested nodes, which are not supported");
        if (member(node, "mesh").is_null()) return;  // a camera or a light
        for (const char* move : {"matrix", "translation", "rotation", "scale"}) {
            if (!member(node, move).is_null())
                input_.refuse("has a node with a " + std::string(move) +
                              ", which is not supported; apply it before exporting");
        }
        const Json& mesh = element("meshes", number(node, "mesh", {}));
        const Json& name = member(node, "name");
        objects_.push_back({name.is_string() ? name.get<std::string>() : "", mesh_.triangles.size()});
        for (const Json& primitive : list(mesh, "primitives")) add_primitive(primitive);
    }

    void add_primitive(const Json& primitive) {
        constexpr std::uint64_t kTriangles = 4;
        if (number(primitive, "mode", kTriangles) != kTriangles)
            input_.refuse("has lines, points, strips or fans, which are not supported");
        // Primitives with the same accessor share its points.
        const std::uint64_t accessor = number(member(primitive, "attributes"), "POSITION", {});
        const auto [at, is_new] = points_of_.try_emplace(accessor);
        if (is_new) at->second = add_points(elements(accessor, "VEC3"));
        const Json& indices = member(primitive, "indices");
        if (indices.is_null()) input_.refuse("has triangles without indices, which are not supported");
        add_triangles(elements(number(indices), "SCALAR"), at->second);
    }

    // The points of the mesh that belong to an accessor.
    struct PointRange {
        std::uint64_t first = 0, count = 0;
    };

    PointRange add_points(const Elements& points) {
        if (points.component_type != kFloat)
            input_.refuse("has points that are not floats, which is not supported");
        const PointRange range{mesh_.points.size(), points.count};
        for (std::uint64_t i = 0; i < points.count; ++i) {
            reading_(static_cast<double>(bytes_read_), static_cast<double>(buffer_.size()));
            Vec3f p;
            std::memcpy(p.data(), points.begin + i * points.stride, sizeof p);
            mesh_.points.push_back(position(p));
        }
        return range;
    }

    void add_triangles(const Elements& corners, const PointRange& points) {
        if (corners.component_type == kFloat) input_.refuse("has indices that are not integers");
        if (corners.count % 3 != 0) input_.refuse("has an incomplete triangle");
        Triangle triangle{};
        for (std::uint64_t i = 0; i < corners.count; ++i) {
            reading_(static_cast<double>(bytes_read_), static_cast<double>(buffer_.size()));
            std::uint32_t index = 0;
            std::memcpy(&index, corners.begin + i * corners.stride, size_of(corners.component_type));
            if (index >= points.count)
                input_.refuse("a triangle names point " + std::to_string(index) + ", which is missing");
            triangle[i % 3] = static_cast<std::uint32_t>(points.first + index);
            if (i % 3 == 2) mesh_.triangles.push_back(triangle);
        }
    }

    Elements elements(std::uint64_t index, const char* type) {
        const Json& accessor = element("accessors", index);
        if (member(accessor, "type") != type) input_.refuse("has an accessor of the wrong type");
        if (!member(accessor, "sparse").is_null() || member(accessor, "bufferView").is_null())
            input_.refuse("has sparse accessors, which are not supported");
        const Json& view = element("bufferViews", number(accessor, "bufferView", {}));
        const std::uint64_t buffer = number(view, "buffer", {});
        if (buffer != 0 || !member(element("buffers", buffer), "uri").is_null())
            input_.refuse("has buffers outside the file, which are not supported");
        Elements found;
        found.component_type = number(accessor, "componentType", {});
        const std::uint64_t size = size_of(found.component_type) * (type == std::string_view("VEC3") ? 3 : 1);
        found.count = number(accessor, "count", {});
        found.stride = number(view, "byteStride", size);
        const std::uint64_t view_begin = number(view, "byteOffset", 0),
                            view_size = number(view, "byteLength", {}),
                            begin = number(accessor, "byteOffset", 0);
        const bool view_fits = view_begin <= buffer_.size() && view_size <= buffer_.size() - view_begin;
        const bool fits = found.count == 0 || (begin + size <= view_size && found.stride >= size &&
                                               found.count - 1 <= (view_size - begin - size) / found.stride);
        if (!view_fits || !fits)
            input_.refuse("an accessor reaches beyond its buffer; the file may be cut off");
        // No byte is used twice, so that a small file cannot describe a huge mesh.
        bytes_read_ += size * found.count;
        if (bytes_read_ > buffer_.size()) input_.refuse("uses the same bytes several times");
        found.begin = buffer_.data() + view_begin + begin;
        return found;
    }

    std::size_t size_of(std::uint64_t component_type) const {
        constexpr std::uint64_t kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125;
        if (component_type == kUnsignedByte) return 1;
        if (component_type == kUnsignedShort) return 2;
        if (component_type == kUnsignedInt || component_type == kFloat) return 4;
        input_.refuse("has an accessor of component type " + std::to_string(component_type) +
                      ", which is not supported");
    }

    static constexpr std::uint64_t kFloat = 5126;
    const FileContent& input_;
    std::vector<ObjectStart>& objects_;
    ReadingProgress reading_;
    Json json_;
    std::string_view buffer_;
    Mesh mesh_;
    std::map<std::uint64_t, PointRange> points_of_;  // by position accessor
    std::uint64_t bytes_read_ = 0;
};

}  // namespace

Mesh read_glb(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress) {
    GlbReader reader(input, objects, progress);
    Mesh mesh = reader.read();
    if (!reader.names_no_space()) space = Space::LPS;  // glTF defines the orientation of a model
    return mesh;
}

}  // namespace marrow::internal::io
