// Reads PLY: a text header describes the records after it, which are text or binary.
#include <algorithm>
#include <bit>
#include <cstring>

#include "io/bytes/text.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

enum class Encoding { text, little, big };

struct Type {
    char kind;  // i signed, u unsigned, f floating
    std::size_t size;
};

std::optional<Type> type_of(std::string_view name) {
    if (name == "char" || name == "int8") return Type{'i', 1};
    if (name == "uchar" || name == "uint8") return Type{'u', 1};
    if (name == "short" || name == "int16") return Type{'i', 2};
    if (name == "ushort" || name == "uint16") return Type{'u', 2};
    if (name == "int" || name == "int32") return Type{'i', 4};
    if (name == "uint" || name == "uint32") return Type{'u', 4};
    if (name == "float" || name == "float32") return Type{'f', 4};
    if (name == "double" || name == "float64") return Type{'f', 8};
    return std::nullopt;
}

struct Property {
    std::string name;
    Type type;
    std::optional<Type> count;  // type of the length, if it is a list
};

struct Element {
    std::string name;
    std::int64_t count = 0;
    std::vector<Property> properties;
};

template <class T>
double value_of(const char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
}

// Iterates over the numbers after the header.
class Numbers {
  public:
    Numbers(const FileContent& input, std::size_t at, Encoding encoding)
        : input_(input), at_(at), encoding_(encoding) {}

    double next(const Type& type) { return encoding_ == Encoding::text ? next_word() : next_binary(type); }

  private:
    double next_word() {
        const auto is_space = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
        const std::string& bytes = input_.bytes;
        while (at_ < bytes.size() && is_space(bytes[at_])) ++at_;
        const std::size_t begin = at_;
        while (at_ < bytes.size() && !is_space(bytes[at_])) ++at_;
        if (begin == at_) input_.refuse("the file is cut off");
        const std::string_view word = std::string_view(bytes).substr(begin, at_ - begin);
        const std::optional<double> value = parse_double(word);
        if (!value) input_.refuse("a value is not a number: " + quoted(word));
        return *value;
    }

    double next_binary(const Type& type) {
        if (input_.bytes.size() - at_ < type.size) input_.refuse("the file is cut off");
        char bytes[8];
        std::memcpy(bytes, input_.bytes.data() + at_, type.size);
        at_ += type.size;
        if (encoding_ == Encoding::big) std::reverse(bytes, bytes + type.size);
        if (type.kind == 'f') return type.size == 4 ? value_of<float>(bytes) : value_of<double>(bytes);
        switch (type.size) {
            case 1:
                return type.kind == 'i' ? value_of<std::int8_t>(bytes) : value_of<std::uint8_t>(bytes);
            case 2:
                return type.kind == 'i' ? value_of<std::int16_t>(bytes) : value_of<std::uint16_t>(bytes);
            default:
                return type.kind == 'i' ? value_of<std::int32_t>(bytes) : value_of<std::uint32_t>(bytes);
        }
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

}  // namespace

Mesh read_ply(const FileContent& input, Space& space) {
    const Header header = parse_header(input, space);
    Numbers numbers(input, header.end, header.encoding);
    Mesh mesh;
    std::vector<std::int64_t> corners;
    bool has_points = false;
    for (const Element& element : header.elements) {
        // An element without properties takes no bytes, so its count can be arbitrarily large.
        for (std::int64_t i = 0; i < (element.properties.empty() ? 0 : element.count); ++i) {
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
                if (element.name == "face" && property.name.starts_with("vertex_ind"))
                    add_polygon(input, corners, mesh.points.size(), mesh);
            }
            if (element.name == "vertex") mesh.points.push_back(point);
        }
        has_points = has_points || element.name == "vertex";
    }
    if (!has_points) input.refuse("has no points");
    return mesh;
}

}  // namespace marrow::internal::io
