// Reads 3MF after its core specification 1.2: a ZIP archive with an XML model. The model's build items name
// its objects, each with an optional transform.
#include <cmath>
#include <map>

#include "io/bytes/text.h"
#include "io/bytes/xml.h"
#include "io/bytes/zip_reader.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

struct Object {
    Mesh mesh;
    std::string name = {};
    bool has_components = false;  // it consists of other objects
    bool built = false;
};

// Rows 0 to 2 multiply x, y and z; row 3 is added.
using Transform = std::array<std::array<double, 3>, 4>;

double determinant(const Transform& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Returns the file of the archive that its relationships name as the model.
FileContent model_of(const FileContent& archive) {
    const ZipReader zip(archive);
    const FileContent relations{archive.path, zip.file("_rels/.rels")};
    XmlTag tag;
    for (std::size_t at = 0; next_tag(relations, at, tag); at = tag.end) {
        if (tag.name != "Relationship" || !tag.get("Type").ends_with("/3dmodel")) continue;
        std::string_view target = tag.get("Target");
        if (target.starts_with('/')) target.remove_prefix(1);
        return {archive.path, zip.file(target)};
    }
    archive.refuse("the ZIP archive names no 3D model");
}

class ModelReader {
  public:
    ModelReader(const FileContent& model, std::vector<ObjectStart>& built_objects)
        : model_(model), built_objects_(built_objects) {}

    Mesh read(Space& space) {
        Object* object = nullptr;
        bool begun = false, ended = false;
        for (std::size_t at = 0; next_tag(model_, at, tag_); at = tag_.end) {
            if (tag_.name == "vertex" || tag_.name == "triangle" || tag_.name == "component") {
                if (object == nullptr) model_.refuse("has a " + std::string(tag_.name) + " outside objects");
                if (tag_.name == "vertex") object->mesh.points.push_back(point());
                if (tag_.name == "triangle") object->mesh.triangles.push_back(triangle(object->mesh.points));
                if (tag_.name == "component") object->has_components = true;
            }
            if (tag_.name == "model") begun = true, begin_model();
            if (tag_.name == "/model") ended = true;
            if (tag_.name == "object") {
                const auto [added, is_new] = objects_.try_emplace(std::string(tag_.get("id")));
                if (!is_new) model_.refuse("has two objects " + quoted(tag_.get("id")));
                object = &added->second;
                object->name = tag_.get("name");
            }
            if (tag_.name == "/object") object = nullptr;
            if (tag_.name == "item") build();
            if (tag_.name == "metadata" && tag_.get("name") == "Description") {
                const std::string_view text = std::string_view(model_.bytes).substr(tag_.end);
                space = stated_space(text.substr(0, text.find('<')));
            }
        }
        if (!begun || !ended) model_.refuse("its 3D model is cut off or invalid");
        if (built_.points.empty()) model_.refuse("has no build items");
        return std::move(built_);
    }

  private:
    void begin_model() {
        const std::string_view unit = tag_.get("unit");
        const std::optional<double> scale = unit.empty()     ? 1
                                            : unit == "inch" ? 25.4
                                            : unit == "foot" ? 304.8
                                                             : millimetres(unit);
        if (!scale) model_.refuse("is in an unknown unit " + quoted(unit));
        scale_ = *scale;
        if (const std::string_view needed = tag_.get("requiredextensions"); !needed.empty())
            model_.refuse("needs unsupported 3MF extensions: " + quoted(needed));
    }

    template <class T>
    T attribute(const char* name, std::optional<T> (*parse)(std::string_view)) const {
        const std::optional<T> value = parse(tag_.get(name));
        if (!value) {
            model_.refuse("the attribute " + std::string(name) + " of a " + std::string(tag_.name) +
                          " is not a number: " + quoted(tag_.get(name)));
        }
        return *value;
    }

    Vec3f point() const {
        return {static_cast<float>(attribute("x", parse_double)),
                static_cast<float>(attribute("y", parse_double)),
                static_cast<float>(attribute("z", parse_double))};
    }

    Triangle triangle(const Buffer<Vec3f>& points) const {
        Triangle corners{};
        constexpr const char* kNames[] = {"v1", "v2", "v3"};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int64_t index = attribute(kNames[c], parse_integer);
            if (index < 0 || index >= static_cast<std::int64_t>(points.size()))
                model_.refuse("a triangle names point " + std::to_string(index) + ", which is missing");
            corners[c] = static_cast<std::uint32_t>(index);
        }
        return corners;
    }

    Transform transform() const {
        const std::vector<std::string_view> w = split(tag_.get("transform"));
        if (w.empty()) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
        Transform m{};
        if (w.size() != 12) model_.refuse("an item's transform does not have 12 numbers");
        for (std::size_t i = 0; i < 12; ++i) {
            const std::optional<double> value = parse_double(w[i]);
            if (!value) model_.refuse("a value is not a number: " + quoted(w[i]));
            m[i / 3][i % 3] = *value;
        }
        return m;
    }

    void build() {
        const std::string_view id = tag_.get("objectid");
        const auto found = objects_.find(std::string(id));
        if (found == objects_.end()) model_.refuse("builds object " + quoted(id) + ", which is missing");
        Object& object = found->second;
        if (object.has_components)
            model_.refuse("object " + quoted(id) + " consists of other objects, which is not supported");
        if (object.built) model_.refuse("builds object " + quoted(id) + " twice, which is not supported");
        object.built = true;
        built_objects_.push_back({object.name, built_.triangles.size()});
        Transform m = transform();
        const bool unchanged = tag_.get("transform").empty() && scale_ == 1;  // keep the bits
        const bool mirrored = determinant(m) < 0;
        for (auto& row : m) {
            for (double& value : row) value *= scale_;
        }
        const std::size_t first = built_.points.size();
        for (const Vec3f& p : object.mesh.points) {
            Vec3f moved = p;
            for (std::size_t a = 0; a < 3 && !unchanged; ++a)
                moved[a] = static_cast<float>(p[0] * m[0][a] + p[1] * m[1][a] + p[2] * m[2][a] + m[3][a]);
            built_.points.push_back(moved);
        }
        for (Triangle t : object.mesh.triangles) {
            for (std::uint32_t& corner : t) corner += static_cast<std::uint32_t>(first);
            if (mirrored) std::swap(t[1], t[2]);
            built_.triangles.push_back(t);
        }
        object.mesh = {};
    }

    const FileContent& model_;
    std::vector<ObjectStart>& built_objects_;
    XmlTag tag_;
    std::map<std::string, Object> objects_;
    Mesh built_;
    double scale_ = 1;  // mm
};

}  // namespace

Mesh read_3mf(const FileContent& input, Space& space, std::vector<ObjectStart>& objects) {
    const FileContent model = model_of(input);
    return ModelReader(model, objects).read(space);
}

}  // namespace marrow::internal::io
