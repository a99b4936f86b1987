// Reads VTK XML PolyData. Its arrays are text, base64 or raw bytes, in the XML or appended to it, perhaps
// compressed by zlib. See https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html.
#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "io/bytes/text.h"
#include "io/bytes/xml.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

// Decodes base64 up to its padding or any other character.
std::string from_base64(std::string_view text) {
    std::string bytes;
    std::uint32_t bits = 0;
    int have = 0;
    for (const char c : text) {
        int value;
        if (c >= 'A' && c <= 'Z')
            value = c - 'A';
        else if (c >= 'a' && c <= 'z')
            value = c - 'a' + 26;
        else if (c >= '0' && c <= '9')
            value = c - '0' + 52;
        else if (c == '+')
            value = 62;
        else if (c == '/')
            value = 63;
        else
            break;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        if ((have += 6) >= 8) bytes += static_cast<char>(bits >> (have -= 8));
    }
    return bytes;
}

class VtpReader {
  public:
    VtpReader(const FileContent& input, std::vector<ObjectStart>& objects)
        : input_(input), objects_(objects) {}

    Mesh read(Space& space) {
        std::string_view section;
        std::size_t piece = 0;
        std::vector<double> points, connectivity, offsets, surfaces;
        find_appended();
        XmlTag tag;
        for (std::size_t at = 0; at < xml_end_ && next_tag(input_, at, tag) && tag.begin < xml_end_;) {
            at = tag.end;
            if (tag.name == "VTKFile") begin_file(tag);
            if (tag.name == "Points" || tag.name == "Polys" || tag.name == "FieldData" ||
                tag.name == "CellData" || tag.name == "Strips")
                section = tag.name;
            if (tag.name == "/Points" || tag.name == "/Polys" || tag.name == "/FieldData" ||
                tag.name == "/CellData")
                section = {};
            if (tag.name == "Piece") {
                piece = mesh_.points.size();
                if (!tag.get("NumberOfStrips").empty() && tag.get("NumberOfStrips") != "0")
                    input_.refuse("has triangle strips, which are not supported");
                connectivity.clear(), offsets.clear(), surfaces.clear();
            }
            if (tag.name == "DataArray" && section == "Points") {
                points = values(tag);
                if (points.size() % 3 != 0) input_.refuse("its points do not have three coordinates each");
                for (std::size_t i = 0; i < points.size(); i += 3)
                    mesh_.points.push_back({static_cast<float>(points[i]), static_cast<float>(points[i + 1]),
                                            static_cast<float>(points[i + 2])});
            }
            if (tag.name == "DataArray" && section == "Polys")
                (tag.get("Name") == "offsets" ? offsets : connectivity) = values(tag);
            if (tag.name == "DataArray" && section == "FieldData" && tag.get("Name") == "SPACE")
                space = stated_space("SPACE=" + text_of(values(tag)));
            if (tag.name == "DataArray" && section == "FieldData" && tag.get("Name") == "Names")
                names_ = text_of(values(tag));
            if (tag.name == "DataArray" && section == "CellData" && tag.get("Name") == "Surface")
                surfaces = values(tag);
            if (tag.name == "/Piece") add_polygons(connectivity, offsets, surfaces, piece);
        }
        if (!is_file_) input_.refuse("is not a VTK PolyData file");
        return std::move(mesh_);
    }

  private:
    void begin_file(const XmlTag& tag) {
        is_file_ = tag.get("type") == "PolyData";
        if (tag.get("byte_order") == "BigEndian") input_.refuse("is big-endian, which is not supported");
        if (tag.get("header_type") == "UInt64") word_ = 8;
        const std::string_view compressor = tag.get("compressor");
        compressed_ = !compressor.empty();
        if (compressed_ && compressor != "vtkZLibDataCompressor")
            input_.refuse("is compressed by " + quoted(compressor) + ", which is not supported");
    }

    // The XML ends where the appended data begin, because they may hold any bytes.
    void find_appended() {
        xml_end_ = input_.bytes.size();
        const std::size_t at = input_.bytes.find("<AppendedData");
        if (at == std::string::npos) return;
        XmlTag tag;
        next_tag(input_, at, tag);
        xml_end_ = at;
        appended_raw_ = tag.get("encoding") == "raw";
        const std::size_t mark = input_.bytes.find('_', tag.end);
        if (mark == std::string::npos) input_.refuse("its appended data are cut off");
        appended_ = mark + 1;
    }

    std::uint64_t word(std::string_view bytes, std::size_t i) const {
        if (bytes.size() / word_ <= i) input_.refuse("an array is cut off");
        std::uint64_t value = 0;
        std::memcpy(&value, bytes.data() + i * word_, word_);
        return value;
    }

    // Returns the bytes of an array that starts at `text`, in base64 or raw.
    std::string unpack(std::string_view text, bool raw) const {
        if (!compressed_) {
            const std::string decoded = raw ? std::string() : from_base64(text);
            const std::string_view bytes = raw ? text : std::string_view(decoded);
            const std::uint64_t size = word(bytes, 0);
            if (bytes.size() - word_ < size) input_.refuse("an array is cut off");
            return std::string(bytes.substr(word_, size));
        }
        // The header: number of blocks, size of a block, size of the last block, compressed size of each
        // block.
        const auto base64_size = [](std::uint64_t bytes) { return (bytes + 2) / 3 * 4; };
        std::string decoded = raw ? std::string() : from_base64(text.substr(0, base64_size(3 * word_)));
        const std::uint64_t blocks = word(raw ? text : std::string_view(decoded), 0);
        if (blocks > text.size()) input_.refuse("an array is cut off");
        const std::uint64_t header_size = (3 + blocks) * word_;
        if (!raw) decoded = from_base64(text.substr(0, base64_size(header_size)));
        const std::string header(raw ? text.substr(0, header_size) : std::string_view(decoded));
        text.remove_prefix(
            std::min<std::uint64_t>(raw ? header_size : base64_size(header_size), text.size()));
        if (!raw) decoded = from_base64(text);
        std::string_view compressed = raw ? text : std::string_view(decoded);
        std::string bytes;
        for (std::uint64_t b = 0; b < blocks; ++b) {
            const std::uint64_t last = word(header, 2), compressed_size = word(header, 3 + b);
            const std::uint64_t size = b + 1 == blocks && last > 0 ? last : word(header, 1);
            // zlib compresses to no less than a thousandth.
            if (compressed_size > compressed.size() || size / 1100 > compressed_size)
                input_.refuse("an array is cut off");
            const std::size_t before = bytes.size();
            bytes.resize(before + size);
            uLongf found = size;
            const int result = uncompress(reinterpret_cast<Bytef*>(bytes.data() + before), &found,
                                          reinterpret_cast<const Bytef*>(compressed.data()), compressed_size);
            if (result != Z_OK || found != size) input_.refuse("an array is damaged");
            compressed.remove_prefix(compressed_size);
        }
        return bytes;
    }

    template <class T>
    static std::vector<double> converted(const std::string& bytes) {
        std::vector<double> values(bytes.size() / sizeof(T));
        for (std::size_t i = 0; i < values.size(); ++i) {
            T value;
            std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
            values[i] = static_cast<double>(value);
        }
        return values;
    }

    std::vector<double> values(const XmlTag& tag) const {
        const std::string_view format = tag.get("format"), type = tag.get("type");
        std::string_view text = std::string_view(input_.bytes).substr(tag.end);
        if (format == "ascii") {
            std::vector<double> result;
            for (const std::string_view word : split(text.substr(0, text.find('<')))) {
                const std::optional<double> value = parse_double(word);
                if (!value) input_.refuse("a value is not a number: " + quoted(word));
                result.push_back(*value);
            }
            return result;
        }
        bool raw = false;
        if (format == "appended") {
            const std::optional<std::int64_t> offset = parse_integer(tag.get("offset"));
            if (appended_ == 0 || !offset || *offset < 0 ||
                static_cast<std::uint64_t>(*offset) > input_.bytes.size() - appended_)
                input_.refuse("an array's offset is outside the file");
            text = std::string_view(input_.bytes).substr(appended_ + static_cast<std::size_t>(*offset));
            raw = appended_raw_;
        } else {
            text = trimmed(text.substr(0, text.find('<')));
        }
        const std::string bytes = unpack(text, raw);
        if (type == "Float32") return converted<float>(bytes);
        if (type == "Float64") return converted<double>(bytes);
        if (type == "Int32") return converted<std::int32_t>(bytes);
        if (type == "UInt32") return converted<std::uint32_t>(bytes);
        if (type == "Int64") return converted<std::int64_t>(bytes);
        if (type == "UInt64") return converted<std::uint64_t>(bytes);
        if (type == "UInt8" || type == "String") return converted<std::uint8_t>(bytes);
        input_.refuse("has an array of type " + quoted(type) + ", which is not supported");
    }

    static std::string text_of(const std::vector<double>& codes) {
        std::string text;
        for (const double code : codes) text += static_cast<char>(code);
        return text;
    }

    // The name of a surface: its place among texts that end with 0.
    std::string name_of(double surface) const {
        std::string_view rest = names_;
        for (; surface >= 1 && !rest.empty(); --surface)
            rest.remove_prefix(std::min(rest.find('\0'), rest.size() - 1) + 1);
        return std::string(rest.substr(0, rest.find('\0')));
    }

    void add_polygons(const std::vector<double>& connectivity, const std::vector<double>& offsets,
                      const std::vector<double>& surfaces, std::size_t first_point) {
        std::vector<std::int64_t> corners;
        double from = 0;
        const bool separated = surfaces.size() == offsets.size();
        for (std::size_t polygon = 0; polygon < offsets.size(); ++polygon) {
            const double to = offsets[polygon];
            if (separated && (polygon == 0 || surfaces[polygon] != surfaces[polygon - 1]))
                objects_.push_back({name_of(surfaces[polygon]), mesh_.triangles.size()});
            if (!(to >= from && to <= static_cast<double>(connectivity.size())))
                input_.refuse("a polygon's corners are outside the connectivity array");
            corners.clear();
            for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i)
                corners.push_back(connectivity[i] >= 0 && connectivity[i] < 1e15
                                      ? static_cast<std::int64_t>(connectivity[i]) +
                                            static_cast<std::int64_t>(first_point)
                                      : -1);
            add_polygon(input_, corners, mesh_.points.size(), mesh_);
            from = to;
        }
    }

    const FileContent& input_;
    std::vector<ObjectStart>& objects_;
    Mesh mesh_;
    std::string names_;  // of the surfaces, each followed by 0
    bool is_file_ = false, compressed_ = false, appended_raw_ = false;
    std::size_t word_ = 4;      // bytes of a length field
    std::size_t xml_end_ = 0;   // offset of the end of the XML
    std::size_t appended_ = 0;  // offset of the appended data; 0 if there are none
};

}  // namespace

Mesh read_vtp(const FileContent& input, Space& space, std::vector<ObjectStart>& objects) {
    return VtpReader(input, objects).read(space);
}

}  // namespace marrow::internal::io
