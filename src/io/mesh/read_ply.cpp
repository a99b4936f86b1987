// Reads PLY: a text header describes the records after it, which are text or binary.
#include <algorithm>
#include <cstring>

#include "io/bytes/stored_samples.h"
#include "io/bytes/text.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

enum class Encoding { text, little, big };

std::optional<StoredType> type_of(std::string_view name) {
    static constexpr TypeName kNames[] = {
        {"char|int8", StoredType::int8},        {"uchar|uint8", StoredType::uint8},
        {"short|int16", StoredType::int16},     {"ushort|uint16", StoredType::uint16},
        {"int|int32", StoredType::int32},       {"uint|uint32", StoredType::uint32},
        {"float|float32", StoredType::float32}, {"double|float64", StoredType::float64}};
    return find_type(kNames, name);
}

struct Property {
    std::string name;
    StoredType type;
    std::optional<StoredType> count;  // type of the length, if it is a list
};

struct Element {
    std::string name;
    std::int64_t count = 0;
    std::vector<Property> properties;
};

// Iterates over the numbers after the header.
class Numbers {
  public:
    Numbers(const FileContent& input, std::size_t at, Encoding encoding)
        : input_(input), at_(at), encoding_(encoding) {}

    std::size_t at() const { return at_; }
    double next(StoredType type) { return encoding_ == Encoding::text ? next_word() : next_binary(type); }

  private:
    double next_word() {
        std::string_view rest = std::string_view(input_.bytes).substr(at_);
        const std::string_view word = take_word(rest);
        if (word.empty()) input_.refuse("the file is cut off");
        at_ = input_.bytes.size() - rest.size();
        const std::optional<double> value = parse_double(word);
        if (!value) input_.refuse("a value is not a number: " + quoted(word));
        return *value;
    }

    double next_binary(StoredType type) {
        return with_stored_type(type, [&](auto value) {
            if (input_.bytes.size() - at_ < sizeof value) input_.refuse("the file is cut off");
            std::memcpy(&value, input_.bytes.data() + at_, sizeof value);
            at_ += sizeof value;
            to_native_order(&value, 1, type, encoding_ == Encoding::big);
            return static_cast<double>(value);
        });
    }

    const FileContent& input_;
    std::size_t at_;
    const Encoding encoding_;
};

struct Header {
    Encoding encoding = Encoding::text;
    std::vector<Element> elements;
    std::size_t end = 0;
};

Header parse_header(const FileContent& input, Space& space) {
    Header header;
    bool has_format = false;
    for (std::size_t at = 0; header.end == 0;) {
        const std::size_t end = input.bytes.find('\n', at);
        if (end == std::string::npos || end > (1 << 20)) input.refuse("the PLY header has no end");
        const std::string_view line = std::string_view(input.bytes).substr(at, end - at);
        const std::vector<std::string_view> w = split(line);
        if (at == 0 && (w.empty() || w[0] != "ply")) input.refuse("is not a PLY file");
        at = end + 1;
        if (w.empty()) continue;
        if (w[0] == "comment" && space == Space::none) space = stated_space(line);
        if (w[0] == "end_header") header.end = at;
        if (w[0] == "format" && w.size() > 1) {
            has_format = true;
            if (w[1] == "binary_little_endian")
                header.encoding = Encoding::little;
            else if (w[1] == "binary_big_endian")
                header.encoding = Encoding::big;
            else if (w[1] != "ascii")
                input.refuse("unknown PLY format " + quoted(w[1]));
        }
        if (w[0] == "element") {
            const auto count = w.size() == 3 ? parse_integer(w[2]) : std::nullopt;
            if (!count || *count < 0) input.refuse("a PLY element has no count");
            header.elements.push_back({std::string(w[1]), *count, {}});
        }
        if (w[0] == "property") {
            const bool list = w.size() == 5 && w[1] == "list";
            const auto type = w.size() < 3 ? std::nullopt : type_of(w[list ? 3 : 1]);
            const auto count = list ? type_of(w[2]) : std::nullopt;
            if (header.elements.empty() || !type || (list && !count))
                input.refuse("a PLY property is invalid: " + quoted(line));
            header.elements.back().properties.push_back({std::string(w.back()), *type, count});
        }
    }
    if (!has_format) input.refuse("the PLY header names no format");
    return header;
}

bool is_corners(const Property& property) {
    return property.count && property.name.starts_with("vertex_ind");
}

// Refuses a geometry that is described in another way than the one which is read.
void check_elements(const FileContent& input, const std::vector<Element>& elements) {
    bool has_points = false;
    for (const auto& [name, count, properties] : elements) {
        if (name == "tristrips" && count > 0)
            input.refuse("has triangle strips, which are not supported; save its triangles as faces");
        if (name == "face" && count > 0 && std::none_of(properties.begin(), properties.end(), is_corners))
            input.refuse("its faces have no list vertex_indices; save it with one");
        if (name != "vertex") continue;
        has_points = true;
        for (const char* axis : {"x", "y", "z"}) {
            const auto is_coordinate = [&](const Property& p) { return p.name == axis && !p.count; };
            if (std::none_of(properties.begin(), properties.end(), is_coordinate))
                input.refuse("its points have no coordinate " + std::string(axis) +
                             "; save it with x, y and z");
        }
    }
    if (!has_points) input.refuse("has no points");
}

}  // namespace

Mesh read_ply(const FileContent& input, Space& space, const Progress& progress) {
    ReadingProgress reading(progress);
    const Header header = parse_header(input, space);
    check_elements(input, header.elements);
    Numbers numbers(input, header.end, header.encoding);
    Mesh mesh;
    std::vector<std::int64_t> corners;
    for (const Element& element : header.elements) {
        // An element without properties takes no bytes, so its count can be arbitrarily large.
        for (std::int64_t i = 0; i < (element.properties.empty() ? 0 : element.count); ++i) {
            reading(static_cast<double>(numbers.at()), static_cast<double>(input.bytes.size()));
            Vec3f point{};
            for (const Property& property : element.properties) {
                if (!property.count) {
                    const double value = numbers.next(property.type);
                    if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
                        point[static_cast<std::size_t>(property.name[0] - 'x')] = static_cast<float>(value);
                    continue;
                }
                const double size = numbers.next(*property.count);
                corners.clear();
                for (double c = 0; c < size; ++c) {
                    const double corner = numbers.next(property.type);
                    // add_polygon refuses -1.
                    corners.push_back(corner >= 0 && corner < 1e15 ? static_cast<std::int64_t>(corner) : -1);
                }
                if (element.name == "face" && is_corners(property))
                    add_polygon(input, corners, mesh.points.size(), mesh);
            }
            if (element.name == "vertex") mesh.points.push_back(point);
        }
    }
    return mesh;
}

}  // namespace marrow::internal::io
