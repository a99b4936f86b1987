// Reads VTK XML PolyData. Its arrays are text, base64 or raw bytes, in the XML or appended to it, perhaps
// compressed by zlib. See https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>

#include "io/bytes/stored_samples.h"
#include "io/bytes/text.h"
#include "io/bytes/xml.h"
#include "reader.h"

namespace marrow::internal::io {

namespace {

// The values of the digits of base64; -1 of other characters.
constexpr std::array<int, 256> kBase64 = [] {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<int, 256> values{};
    values.fill(-1);
    int value = 0;
    for (const char digit : kDigits) values[static_cast<unsigned char>(digit)] = value++;
    return values;
}();

// Decodes base64 up to its padding or any other character.
std::string from_base64(std::string_view text) {
    std::string bytes;
    std::uint32_t bits = 0;
    int have = 0;
    for (const char c : text) {
        const int value = kBase64[static_cast<unsigned char>(c)];
        if (value < 0) break;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        if ((have += 6) >= 8) bytes += static_cast<char>(bits >> (have -= 8));
    }
    return bytes;
}

// An array as its element describes it.
struct Array {
    std::string name, type, format, offset;
    std::string text;  // inside the element
};

class VtpReader : public XmlVisitor {
  public:
    VtpReader(const FileContent& input, std::vector<ObjectStart>& objects, const Progress& progress)
        : input_(input), parser_(input, *this), objects_(objects), reading_(progress) {}

    Mesh read(Space& space) {
        parser_.parse(input_.bytes);
        parser_.finish();
        if (!is_file_) input_.refuse("is not a VTK PolyData file");
        if (!space_.type.empty()) space = stated_space("SPACE=" + text_of(values(space_)));
        const std::vector<std::string> names = names_in(text_of(values(names_)));
        for (const Piece& piece : pieces_) {
            const std::size_t first = mesh_.points.size();
            const std::vector<double> points = values(piece.points);
            if (points.size() % 3 != 0) input_.refuse("its points do not have three coordinates each");
            for (std::size_t i = 0; i < points.size(); i += 3)
                mesh_.points.push_back({static_cast<float>(points[i]), static_cast<float>(points[i + 1]),
                                        static_cast<float>(points[i + 2])});
            add_polygons(piece, names, first);
            ++pieces_read_;
        }
        return std::move(mesh_);
    }

  private:
    struct Piece {
        Array points, connectivity, offsets;
        Array surfaces;  // the number of each polygon's surface
    };

    void begin(const XmlElement& element) override {
        const std::string_view tag = element.name;
        if (tag == "VTKFile") begin_file(element);
        if (tag == "Points" || tag == "Polys" || tag == "CellData" || tag == "FieldData") section_ = tag;
        if (tag == "Piece") {
            if (pieces_.size() == kMostPieces) input_.refuse("has more than 10000 pieces");
            pieces_.emplace_back();
            if (!element.get("NumberOfStrips").empty() && element.get("NumberOfStrips") != "0")
                input_.refuse("has triangle strips, which are not supported");
        }
        array_ = is_array(tag) ? array_named(element.get("Name")) : nullptr;
        if (array_)
            *array_ = {std::string(element.get("Name")), std::string(element.get("type")),
                       std::string(element.get("format")), std::string(element.get("offset")), ""};
        if (tag == "AppendedData") begin_appended(element);
    }

    void end(std::string_view, std::string_view tag) override {
        if (tag == section_) section_.clear();
        if (is_array(tag)) array_ = nullptr;
    }

    void text(std::string_view text) override {
        if (array_) array_->text += text;
    }

    // VTK writes arrays of text as Array.
    static bool is_array(std::string_view tag) { return tag == "DataArray" || tag == "Array"; }

    // Where an array of the current section is kept; null if it is not needed.
    Array* array_named(std::string_view name) {
        if (section_ == "FieldData") return name == "SPACE" ? &space_ : name == "Names" ? &names_ : nullptr;
        if (pieces_.empty()) return nullptr;
        if (section_ == "Points") return &pieces_.back().points;
        if (section_ == "CellData") return name == "Surface" ? &pieces_.back().surfaces : nullptr;
        if (section_ == "Polys")
            return name == "offsets" ? &pieces_.back().offsets : &pieces_.back().connectivity;
        return nullptr;
    }

    void begin_file(const XmlElement& file) {
        is_file_ = file.get("type") == "PolyData";
        if (file.get("byte_order") == "BigEndian") input_.refuse("is big-endian, which is not supported");
        if (file.get("header_type") == "UInt64") word_ = 8;
        const std::string_view compressor = file.get("compressor");
        compressed_ = !compressor.empty();
        if (compressed_ && compressor != "vtkZLibDataCompressor")
            input_.refuse("is compressed by " + quoted(compressor) + ", which is not supported");
    }

    // The XML ends here, because appended data may hold any bytes.
    void begin_appended(const XmlElement& data) {
        appended_raw_ = data.get("encoding") == "raw";
        const std::size_t mark = input_.bytes.find('_', parser_.end_of_tag());
        if (mark == std::string::npos) input_.refuse("its appended data are cut off");
        appended_ = mark + 1;
        parser_.stop();
    }

    std::uint64_t word(std::string_view bytes, std::size_t i) const {
        if (bytes.size() / word_ <= i) input_.refuse("an array is cut off");
        std::uint64_t value = 0;
        std::memcpy(&value, bytes.data() + i * word_, word_);
        return value;
    }

    // Returns the bytes of an array that starts at `text`, in base64 or raw.
    std::string unpack(std::string_view text, bool raw) const {
        // Appended arrays follow each other: only what belongs to this one is decoded.
        const auto base64_size = [](std::uint64_t bytes) { return (bytes + 2) / 3 * 4; };
        const auto decode = [&](std::uint64_t bytes) {
            return raw ? std::string() : from_base64(text.substr(0, base64_size(bytes)));
        };
        if (!compressed_) {
            std::string decoded = decode(word_);
            const std::uint64_t size = word(raw ? text : std::string_view(decoded), 0);
            if (size > text.size()) input_.refuse("an array is cut off");
            decoded = decode(word_ + size);
            const std::string_view bytes = raw ? text : std::string_view(decoded);
            if (bytes.size() - word_ < size) input_.refuse("an array is cut off");
            return std::string(bytes.substr(word_, size));
        }
        // The header: number of blocks, size of a block, size of the last block, compressed size of each
        // block.
        std::string decoded = decode(3 * word_);
        const std::uint64_t blocks = word(raw ? text : std::string_view(decoded), 0);
        if (blocks > text.size()) input_.refuse("an array is cut off");
        const std::uint64_t header_size = (3 + blocks) * word_;
        decoded = decode(header_size);
        const std::string header(raw ? text.substr(0, header_size) : std::string_view(decoded));
        text.remove_prefix(
            std::min<std::uint64_t>(raw ? header_size : base64_size(header_size), text.size()));
        std::uint64_t compressed_bytes = 0;
        for (std::uint64_t b = 0; b < blocks; ++b)
            compressed_bytes += std::min<std::uint64_t>(word(header, 3 + b), text.size());
        decoded = decode(std::min<std::uint64_t>(compressed_bytes, text.size()));
        std::string_view compressed = raw ? text : std::string_view(decoded);
        std::string bytes;
        for (std::uint64_t b = 0; b < blocks; ++b) {
            const std::uint64_t last = word(header, 2), compressed_size = word(header, 3 + b);
            const std::uint64_t size = b + 1 == blocks && last > 0 ? last : word(header, 1);
            // zlib compresses to no less than a thousandth.
            if (compressed_size > compressed.size() || size / 1100 > compressed_size)
                input_.refuse("an array is cut off");
            const std::size_t before = bytes.size();
            check_expansion(before + size);
            bytes.resize(before + size);
            uLongf found = size;
            const int result = uncompress(reinterpret_cast<Bytef*>(bytes.data() + before), &found,
                                          reinterpret_cast<const Bytef*>(compressed.data()), compressed_size);
            if (result != Z_OK || found != size) input_.refuse("an array is damaged");
            compressed.remove_prefix(compressed_size);
        }
        return bytes;
    }

    // Zlib compresses zeros well: a small file could hold a huge mesh.
    void check_expansion(std::uint64_t bytes) const {
        if (unpacked_ + bytes > most_expanded(input_.bytes.size()))
            input_.refuse("its arrays expand to more than 100 times the size of the file");
    }

    std::vector<double> values(const Array& array) {
        if (array.type.empty()) return {};
        std::string_view text = array.text;
        if (array.format == "ascii") {
            std::vector<double> result;
            for (const std::string_view word : split(text)) {
                const std::optional<double> value = parse_double(word);
                if (!value) input_.refuse("a value is not a number: " + quoted(word));
                result.push_back(*value);
            }
            return result;
        }
        bool raw = false;
        if (array.format == "appended") {
            const std::optional<std::int64_t> offset = parse_integer(array.offset);
            if (appended_ == 0 || !offset || *offset < 0 ||
                static_cast<std::uint64_t>(*offset) > input_.bytes.size() - appended_)
                input_.refuse("an array's offset is outside the file");
            text = std::string_view(input_.bytes).substr(appended_ + static_cast<std::size_t>(*offset));
            raw = appended_raw_;
        } else {
            text = trimmed(text);
        }
        const std::string bytes = unpack(text, raw);
        check_expansion(bytes.size());  // pieces can share an array
        unpacked_ += bytes.size();
        static constexpr TypeName kNames[] = {
            {"Float32", StoredType::float32},   {"Float64", StoredType::float64},
            {"Int32", StoredType::int32},       {"UInt32", StoredType::uint32},
            {"Int64", StoredType::int64},       {"UInt64", StoredType::uint64},
            {"UInt8|String", StoredType::uint8}};
        const std::optional<StoredType> type = find_type(kNames, array.type);
        if (!type) input_.refuse("has an array of type " + quoted(array.type) + ", which is not supported");
        std::vector<double> result(bytes.size() / stored_size(*type));
        with_stored_type(*type, [&](auto value) {
            for (std::size_t i = 0; i < result.size(); ++i) {
                std::memcpy(&value, bytes.data() + i * sizeof value, sizeof value);
                result[i] = static_cast<double>(value);
            }
        });
        return result;
    }

    static std::string text_of(const std::vector<double>& codes) {
        std::string text;
        for (const double code : codes)
            text += code >= 0 && code < 256 ? static_cast<char>(static_cast<unsigned char>(code)) : '?';
        return text;
    }

    // Texts that end with 0.
    static std::vector<std::string> names_in(std::string_view text) {
        std::vector<std::string> names;
        while (!text.empty()) {
            names.emplace_back(text.substr(0, text.find('\0')));
            text.remove_prefix(std::min(names.back().size() + 1, text.size()));
        }
        return names;
    }

    void add_polygons(const Piece& piece, const std::vector<std::string>& names, std::size_t first_point) {
        const std::vector<double> connectivity = values(piece.connectivity), offsets = values(piece.offsets),
                                  surfaces = values(piece.surfaces);
        std::vector<std::int64_t> corners;
        double from = 0;
        const bool separated = surfaces.size() == offsets.size();
        for (std::size_t polygon = 0; polygon < offsets.size(); ++polygon) {
            const double to = offsets[polygon];
            reading_(pieces_read_ + static_cast<double>(polygon) / static_cast<double>(offsets.size()),
                     static_cast<double>(pieces_.size()));
            if (separated && (polygon == 0 || surfaces[polygon] != surfaces[polygon - 1])) {
                const double surface = surfaces[polygon];
                const bool is_named = surface >= 0 && surface < static_cast<double>(names.size());
                objects_.push_back({is_named ? names[static_cast<std::size_t>(surface)] : std::string(),
                                    mesh_.triangles.size()});
            }
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
    XmlParser parser_;
    std::vector<ObjectStart>& objects_;
    ReadingProgress reading_;
    std::string section_;  // the current element that holds arrays
    Array* array_ = nullptr;
    Array space_;
    Array names_;  // of the surfaces, each followed by 0
    std::deque<Piece> pieces_;
    double pieces_read_ = 0;
    Mesh mesh_;
    bool is_file_ = false, compressed_ = false, appended_raw_ = false;
    std::size_t word_ = 4;  // bytes of a length field
    static constexpr std::size_t kMostPieces = 10'000;
    std::uint64_t unpacked_ = 0;  // bytes of all arrays
    std::size_t appended_ = 0;    // offset of the appended data; 0 if there are none
};

}  // namespace

Mesh read_vtp(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress) {
    return VtpReader(input, objects, progress).read(space);
}

}  // namespace marrow::internal::io
