// Reads 3MF after its core specification 1.2 and its production extension 1.1: a ZIP archive with XML models.
// The build items of the root model name its objects. An object is a mesh, or is assembled from others
// (components), which may be in other models of the archive. Items and components have an optional transform.
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <marrow/error.h>

#include "io/bytes/text.h"
#include "io/bytes/xml.h"
#include "io/bytes/zip_reader.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

constexpr std::string_view kProduction = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
// Colours and textures, which do not move points.
constexpr std::string_view kMaterials = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";

// Rows 0 to 2 multiply x, y and z; row 3 is added.
using Transform = std::array<std::array<double, 3>, 4>;
constexpr Transform kIdentity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

// The transform that applies `first`, then `second`.
Transform product(const Transform& first, const Transform& second) {
    Transform result{};
    for (std::size_t r = 0; r < 4; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
            if (r == 3) result[r][c] = second[3][c];
            for (std::size_t k = 0; k < 3; ++k) result[r][c] += first[r][k] * second[k][c];
        }
    }
    return result;
}

double determinant(const Transform& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
           m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// A use of an object, by a build item or as a component of another object.
struct Use {
    std::string model, id;  // of the object
    Transform transform;    // in millimetres
};

struct Object {
    std::string name;
    Mesh mesh;
    double scale = 1;  // millimetres per unit of the mesh
    std::vector<Use> components;
    bool is_part = true;  // of what is built
    bool placing = false;
};

constexpr std::size_t kMostParts = 100'000;

struct Scene {
    std::map<std::pair<std::string, std::string>, Object> objects;  // by model and id
    std::vector<Use> items;
    Space space = Space::none;
    std::size_t parts = 0;  // objects, components and items
};

// The name that a reference of the archive stands for, as ZipReader gives it.
std::string file_name(std::string_view reference) {
    if (reference.starts_with('/')) reference.remove_prefix(1);
    return to_lower(reference);
}

// Finds the root model among the relationships of the archive.
class RelationsReader : public XmlVisitor {
  public:
    std::string root;

    void begin(const XmlElement& element) override {
        if (element.name == "Relationship" && element.get("Type").ends_with("/3dmodel") && root.empty())
            root = file_name(element.get("Target"));
    }
    void end(std::string_view, std::string_view) override {}
};

// Takes an element with three attributes off the text, in the form in which almost all programs write it,
// and the white space before it. Returns false at anything else, which is left to the XML parser. `starts`
// is what comes before each value.
template <class T>
bool take_element(std::string_view& text, const std::array<std::string_view, 3>& starts,
                  std::optional<T> (*parse)(std::string_view), std::array<T, 3>& values) {
    const auto skip = [](std::string_view& from) {
        from.remove_prefix(std::min(from.find_first_not_of(" \t\r\n"), from.size()));
    };
    std::string_view rest = text;
    skip(rest);
    for (std::size_t i = 0; i < 3; ++i) {
        if (!rest.starts_with(starts[i])) return false;
        rest.remove_prefix(starts[i].size());
        const std::size_t end = std::min(rest.find('"'), rest.size());
        const std::optional<T> value = parse(rest.substr(0, end));
        if (!value) return false;
        values[i] = *value;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    skip(rest);
    if (!rest.starts_with("/>")) return false;
    text = rest.substr(2);
    return true;
}

// Adds the objects of a model to a scene, and the build items of the root model.
class ModelReader : public XmlVisitor {
  public:
    ModelReader(const FileContent& file, std::string name, bool is_root, Scene& scene)
        : file_(file), name_(std::move(name)), is_root_(is_root), scene_(scene) {}

    void begin(const XmlElement& element) override {
        if (!begun_) begin_model(element);
        if (element.space != core_) return;
        const std::string_view tag = element.name;
        if (tag == "vertex" || tag == "triangle" || tag == "component") {
            if (!object_) file_.refuse("has a " + std::string(tag) + " outside objects");
            if (tag == "vertex") return object_->mesh.points.push_back(point(element));
            if (tag == "triangle") return object_->mesh.triangles.push_back(triangle(element));
        }
        if ((tag == "object" || tag == "component" || tag == "item") && ++scene_.parts > kMostParts)
            file_.refuse("has more than " + std::to_string(kMostParts) + " objects, components and items");
        if (tag == "component") {
            object_->components.push_back(use(element));
        } else if (tag == "object") {
            const auto [added, is_new] = scene_.objects.try_emplace({name_, std::string(element.get("id"))});
            if (!is_new) file_.refuse("has two objects " + quoted(element.get("id")));
            object_ = &added->second;
            object_->scale = scale_;
            object_->name = element.get("name");
            // Slicers save their modifiers, which lie inside other objects, and their supports like this.
            const std::string_view type = element.get("type");
            object_->is_part = type != "other" && type != "support" && type != "solidsupport";
        } else if (tag == "vertices" || tag == "triangles") {
            rows_ = object_ ? tag : "";
        } else if (tag == "item" && is_root_) {
            scene_.items.push_back(use(element));
        } else if (tag == "metadata" && is_root_) {
            in_description_ = element.get("name") == "Description";
        }
    }

    void end(std::string_view space, std::string_view name) override {
        if (space != core_) return;
        if (name == rows_) rows_.clear();
        if (name == "object") object_ = nullptr;
        if (name == "metadata" && std::exchange(in_description_, false))
            scene_.space = stated_space(description_);
    }

    void text(std::string_view text) override {
        if (in_description_) description_ += text;
    }

    void declare_prefix(std::string_view prefix, std::string_view space) override {
        if (!begun_) spaces_.insert_or_assign(std::string(prefix), std::string(space));
        if (begun_ && prefix.empty()) core_is_default_ = false;
    }

    std::size_t take(std::string_view bytes) override {
        if (!core_is_default_) return 0;
        std::string_view rest = bytes;
        if (rows_ == "vertices") {
            std::array<double, 3> p;
            while (take_element(rest, {"<vertex x=\"", " y=\"", " z=\""}, parse_double, p))
                object_->mesh.points.push_back(to_float({p[0], p[1], p[2]}));
        }
        if (rows_ == "triangles") {
            std::array<std::int64_t, 3> t;
            std::string_view next = rest;
            while (take_element(next, {"<triangle v1=\"", " v2=\"", " v3=\""}, parse_integer, t) &&
                   is_point(t[0]) && is_point(t[1]) && is_point(t[2])) {
                object_->mesh.triangles.push_back({static_cast<std::uint32_t>(t[0]),
                                                   static_cast<std::uint32_t>(t[1]),
                                                   static_cast<std::uint32_t>(t[2])});
                rest = next;
            }
        }
        return bytes.size() - rest.size();
    }

  private:
    void begin_model(const XmlElement& model) {
        if (model.name != "model") file_.refuse("is not a 3D model");
        begun_ = true;
        core_ = model.space;
        core_is_default_ = spaces_[""] == core_;
        const std::string_view unit = model.get("unit");
        const std::optional<double> scale = unit.empty() ? 1 : millimetres(unit);
        if (!scale) file_.refuse("is in an unknown unit " + quoted(unit));
        scale_ = *scale;
        for (const std::string_view prefix : split(model.get("requiredextensions"))) {
            const auto space = spaces_.find(prefix);
            if (space == spaces_.end() || (space->second != kProduction && space->second != kMaterials))
                file_.refuse("needs the 3MF extension " + quoted(prefix) + ", which is not supported");
        }
    }

    template <class T>
    T number(const XmlElement& element, const char* name, std::optional<T> (*parse)(std::string_view)) const {
        const std::string_view text = element.get(name);
        const std::optional<T> value = parse(text);
        if (!value) {
            file_.refuse("the attribute " + std::string(name) + " of a " + std::string(element.name) +
                         " is not a number: " + quoted(text));
        }
        return *value;
    }

    Vec3f point(const XmlElement& vertex) const {
        return {static_cast<float>(number(vertex, "x", parse_double)),
                static_cast<float>(number(vertex, "y", parse_double)),
                static_cast<float>(number(vertex, "z", parse_double))};
    }

    bool is_point(std::int64_t index) const {
        return index >= 0 && index < static_cast<std::int64_t>(object_->mesh.points.size());
    }

    Triangle triangle(const XmlElement& element) const {
        Triangle corners{};
        constexpr const char* kNames[] = {"v1", "v2", "v3"};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int64_t index = number(element, kNames[c], parse_integer);
            if (!is_point(index))
                file_.refuse("a triangle names point " + std::to_string(index) + ", which is missing");
            corners[c] = static_cast<std::uint32_t>(index);
        }
        return corners;
    }

    Use use(const XmlElement& element) const {
        Use result{name_, std::string(element.get("objectid")), kIdentity};
        if (const std::string_view path = element.get("path", kProduction); !path.empty()) {
            if (!is_root_) file_.refuse("refers to another model, which only the root model may");
            result.model = file_name(path);
        }
        const std::vector<std::string_view> w = split(element.get("transform"));
        if (w.empty()) return result;
        if (w.size() != 12)
            file_.refuse("the transform of a " + std::string(element.name) + " does not have 12 numbers");
        for (std::size_t i = 0; i < 12; ++i) {
            const std::optional<double> value = parse_double(w[i]);
            if (!value) file_.refuse("a value is not a number: " + quoted(w[i]));
            result.transform[i / 3][i % 3] = i < 9 ? *value : *value * scale_;
        }
        return result;
    }

    const FileContent& file_;
    const std::string name_;
    const bool is_root_;
    Scene& scene_;
    bool begun_ = false;
    std::string core_;  // the namespace of the model, which is that of the core specification
    std::map<std::string, std::string, std::less<>> spaces_;  // by prefix
    double scale_ = 1;                                        // millimetres per unit
    Object* object_ = nullptr;
    std::string rows_;              // "vertices" or "triangles" inside these elements
    bool core_is_default_ = false;  // elements without a prefix are those of the core specification
    bool in_description_ = false;
    std::string description_;
};

// Assembles the build items to one mesh.
class Assembly {
  public:
    Assembly(const FileContent& archive, Scene& scene, std::vector<ObjectStart>& starts)
        : archive_(archive), scene_(scene), starts_(starts) {}

    Mesh build() {
        count();
        Mesh mesh;
        for_each_object(
            [&](const Object& object, const Transform& transform) { add(object, transform, mesh); });
        return mesh;
    }

  private:
    // A small file can ask for very many copies.
    void count() {
        constexpr std::uint64_t kMostCopied = 100'000'000;
        const auto size_of = [](const Mesh& mesh) { return mesh.points.size() + mesh.triangles.size(); };
        std::uint64_t stored = 0, placed = 0, size = 0, points = 0;
        for (const auto& [id, object] : scene_.objects) stored += size_of(object.mesh);
        for_each_object([&](const Object& object, const Transform&) {
            size += size_of(object.mesh);
            points += object.mesh.points.size();
            if (++placed > kMostParts || size > std::max(stored, kMostCopied)) {
                throw LimitError(quoted(archive_.path) + ": places its objects more than " +
                                 std::to_string(kMostParts) +
                                 " times, or its copies of them have more than " +
                                 std::to_string(kMostCopied) + " points and triangles");
            }
        });
        if (points == 0) archive_.refuse("has no build items");
    }

    // Calls `visit(object, transform)` for each place of an object, in the order of the file.
    template <class Visit>
    void for_each_object(Visit visit) {
        for (const Use& item : scene_.items) place(item, kIdentity, 0, visit);
    }

    // Visits an object and its components, moved by the transform of its use and then by `outer`.
    template <class Visit>
    void place(const Use& use, const Transform& outer, int depth, Visit& visit) {
        constexpr int kMostDepth = 100;
        const auto found = scene_.objects.find({use.model, use.id});
        if (found == scene_.objects.end())
            archive_.refuse("builds object " + quoted(use.id) + ", which is missing");
        Object& object = found->second;
        if (object.placing) archive_.refuse("object " + quoted(use.id) + " is a part of itself");
        if (depth > kMostDepth) archive_.refuse("its objects are nested too deeply");
        if (!object.is_part) return;
        const Transform transform = product(use.transform, outer);
        visit(object, transform);
        object.placing = true;
        for (const Use& component : object.components) place(component, transform, depth + 1, visit);
        object.placing = false;
    }

    void add(const Object& object, const Transform& transform, Mesh& mesh) {
        starts_.push_back({object.name, mesh.triangles.size()});
        Transform m = transform;
        for (std::size_t r = 0; r < 3; ++r) {
            for (double& value : m[r]) value *= object.scale;
        }
        const bool unchanged = m == kIdentity;  // keep the bits
        const bool mirrored = determinant(m) < 0;
        const std::size_t first = mesh.points.size();
        for (const Vec3f& p : object.mesh.points) {
            Vec3f moved = p;
            for (std::size_t a = 0; a < 3 && !unchanged; ++a)
                moved[a] = static_cast<float>(p[0] * m[0][a] + p[1] * m[1][a] + p[2] * m[2][a] + m[3][a]);
            mesh.points.push_back(moved);
        }
        for (Triangle t : object.mesh.triangles) {
            for (std::uint32_t& corner : t) corner += static_cast<std::uint32_t>(first);
            if (mirrored) std::swap(t[1], t[2]);
            mesh.triangles.push_back(t);
        }
    }

    const FileContent& archive_;
    Scene& scene_;
    std::vector<ObjectStart>& starts_;
};

// Parses these files of the archive; `visitor(name, file)` returns the visitor of each. How far this is
// remains unknown, but it can be cancelled after each piece.
template <class Visitor>
void parse_files(const FileContent& archive, std::set<std::string> names, const Progress& progress,
                 Visitor visitor) {
    for (ZipReader zip(archive); !names.empty() && zip.next();) {
        if (names.erase(zip.name()) == 0) continue;
        const FileContent file{archive.path / zip.name(), {}};  // for messages
        auto&& receiver = visitor(zip.name(), file);
        XmlParser parser(file, receiver);
        for (std::string_view piece = zip.piece(); !piece.empty(); piece = zip.piece()) {
            report_progress(progress, 0);
            parser.parse(piece);
        }
        parser.finish();
    }
    if (!names.empty()) archive.refuse("the ZIP archive has no file " + quoted(*names.begin()));
}

}  // namespace

Mesh read_3mf(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress) {
    RelationsReader relations;
    parse_files(input, {"_rels/.rels"}, progress, [&](auto&, auto&) -> XmlVisitor& { return relations; });
    if (relations.root.empty()) input.refuse("the ZIP archive names no 3D model");
    Scene scene;
    const auto add_models = [&](const std::set<std::string>& names) {
        parse_files(input, names, progress, [&](const std::string& name, const FileContent& file) {
            return ModelReader(file, name, name == relations.root, scene);
        });
    };
    add_models({relations.root});
    std::set<std::string> others;
    const auto note = [&](const Use& use) {
        if (use.model != relations.root) others.insert(use.model);
    };
    for (const Use& item : scene.items) note(item);
    for (const auto& [id, object] : scene.objects) {
        for (const Use& component : object.components) note(component);
    }
    add_models(others);
    space = scene.space;
    return Assembly(input, scene, objects).build();
}

}  // namespace marrow::internal::io
