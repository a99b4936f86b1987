// 3MF core specification 1.2: a ZIP archive with an XML model in it. Objects are named by what is to be built, each
// perhaps moved.
#include <cmath>
#include <map>

#include "io/bytes/text.h"
#include "reader.h"
#include "io/bytes/xml.h"
#include "io/bytes/zip_reader.h"

namespace marrow {

namespace {

struct Object {
    Mesh mesh;
    bool has_parts = false;  // it is put together from others
    bool built = false;
};

// Rows 0 to 2 multiply x, y and z; row 3 is added.
using Transform = std::array<std::array<double, 3>, 4>;

double determinant(const Transform& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// The part of the archive that its root names as the model.
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
    explicit ModelReader(const FileContent& model) : model_(model) {}

    Mesh read(std::optional<Space>& space) {
        Object* object = nullptr;
        bool begun = false, ended = false;
        for (std::size_t at = 0; next_tag(model_, at, tag_); at = tag_.end) {
            if (tag_.name == "vertex" || tag_.name == "triangle" || tag_.name == "component") {
                if (object == nullptr) model_.refuse("has a " + std::string(tag_.name) + " outside objects");
                if (tag_.name == "vertex") object->mesh.points.push_back(point());
                if (tag_.name == "triangle") object->mesh.triangles.push_back(triangle(object->mesh.points));
                if (tag_.name == "component") object->has_parts = true;
            }
            if (tag_.name == "model") begun = true, begin_model();
            if (tag_.name == "/model") ended = true;
            if (tag_.name == "object") {
                const auto [added, is_new] = objects_.try_emplace(std::string(tag_.get("id")));
                if (!is_new) model_.refuse("has two objects " + shown(tag_.get("id")));
                object = &added->second;
            }
            if (tag_.name == "/object") object = nullptr;
            if (tag_.name == "item") build();
            if (tag_.name == "metadata" && tag_.get("name") == "Description") {
                const std::string_view text = std::string_view(model_.bytes).substr(tag_.end);
                space = marked_space(text.substr(0, text.find('<')));
            }
        }
        if (!begun || !ended) model_.refuse("its 3D model is cut off, or is none");
        if (built_.points.empty()) model_.refuse("names nothing that is to be built");
        return std::move(built_);
    }

  private:
    void begin_model() {
        const std::string_view unit = tag_.get("unit");
        const std::optional<double> scale = unit.empty()     ? 1
                                            : unit == "inch" ? 25.4
                                            : unit == "foot" ? 304.8
                                                             : millimetres(unit);
        if (!scale) model_.refuse("is in an unknown unit " + shown(unit));
        scale_ = *scale;
        if (const std::string_view needed = tag_.get("requiredextensions"); !needed.empty())
            model_.refuse("needs 3MF extensions that are not read: " + shown(needed));
    }

    template <class T>
    T attribute(const char* name, std::optional<T> (*parse)(std::string_view)) const {
        const std::optional<T> value = parse(tag_.get(name));
        if (!value) {
            model_.refuse("a " + std::string(tag_.name) + " has no number " + name + ", but " +
                          shown(tag_.get(name)));
        }
        return *value;
    }

    Vec3f point() const {
        return {static_cast<float>(attribute("x", number)), static_cast<float>(attribute("y", number)),
                static_cast<float>(attribute("z", number))};
    }

    Triangle triangle(const Buffer<Vec3f>& points) const {
        Triangle corners{};
        constexpr const char* kNames[] = {"v1", "v2", "v3"};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int64_t index = attribute(kNames[c], integer);
            if (index < 0 || index >= static_cast<std::int64_t>(points.size()))
                model_.refuse("a triangle names point " + std::to_string(index) + ", which is not there");
            corners[c] = static_cast<std::uint32_t>(index);
        }
        return corners;
    }

    Transform transform() const {
        const std::vector<std::string_view> w = words(tag_.get("transform"));
        if (w.empty()) return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
        Transform m{};
        if (w.size() != 12) model_.refuse("an item's transform does not have 12 numbers");
        for (std::size_t i = 0; i < 12; ++i) {
            const std::optional<double> value = number(w[i]);
            if (!value) model_.refuse("not a number: " + shown(w[i]));
            m[i / 3][i % 3] = *value;
        }
        return m;
    }

    void build() {
        const std::string_view id = tag_.get("objectid");
        const auto found = objects_.find(std::string(id));
        if (found == objects_.end()) model_.refuse("builds object " + shown(id) + ", which is not there");
        Object& object = found->second;
        if (object.has_parts)
            model_.refuse("object " + shown(id) + " is put together from others, which is not read");
        if (object.built) model_.refuse("builds object " + shown(id) + " twice, which is not read");
        object.built = true;
        Transform m = transform();
        const bool as_it_is = tag_.get("transform").empty() && scale_ == 1;  // not a bit may change
        const bool mirrored = determinant(m) < 0;
        for (auto& row : m) {
            for (double& value : row) value *= scale_;
        }
        const std::size_t first = built_.points.size();
        for (const Vec3f& p : object.mesh.points) {
            Vec3f moved = p;
            for (std::size_t a = 0; a < 3 && !as_it_is; ++a)
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
    XmlTag tag_;
    std::map<std::string, Object> objects_;
    Mesh built_;
    double scale_ = 1;  // mm
};

}  // namespace

Mesh read_3mf(const FileContent& input, std::optional<Space>& space) {
    const FileContent model = model_of(input);
    return ModelReader(model).read(space);
}

}  // namespace marrow
