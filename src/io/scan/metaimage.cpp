// Reads MetaImage headers, attached (.mha) and detached (.mhd). See
// https://itk.org/Wiki/ITK/MetaIO/Documentation.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "raw_image.h"

namespace marrow::internal::io {

namespace {

struct Header {
    std::filesystem::path path;
    std::map<std::string, std::string> fields;  // names in lower case
    std::vector<std::string> listed_files;
    std::size_t end = 0;  // offset of the first byte after ElementDataFile

    [[noreturn]] void refuse(std::string_view why) const {
        fail<InputError>(path, "MetaImage header: {}", why);
    }
    // The value of the first of these fields that is present.
    const std::string* find(std::initializer_list<const char*> names) const {
        for (const char* name : names) {
            if (const auto at = fields.find(name); at != fields.end()) return &at->second;
        }
        return nullptr;
    }
    bool flag(std::initializer_list<const char*> names, bool otherwise) const {
        const std::string* text = find(names);
        if (!text) return otherwise;
        return text->starts_with('T') || text->starts_with('t') || text->starts_with('1');
    }
    std::vector<double> numbers(const std::string& text, std::size_t count) const {
        std::vector<double> out;
        for (const auto word : split(text)) {
            const auto value = parse_double(word);
            if (!value) refuse(fmt::format("{} is not a number", quoted(word)));
            out.push_back(*value);
        }
        if (out.size() != count)
            refuse(fmt::format("{} holds {} numbers instead of {}", quoted(text), out.size(), count));
        return out;
    }
};

Header parse(const std::filesystem::path& path) {
    constexpr std::size_t kLongest = 1 << 20;
    const std::string text = read_head(path, kLongest);
    Header header{path, {}, {}, 0};
    // ElementDataFile is the last field. The data, or a list of file names, come after it.
    std::string_view rest = text;
    while (!rest.empty() && !header.fields.contains("elementdatafile")) {
        const std::string_view line = trimmed(take_line(rest));
        if (line.empty()) continue;
        const std::size_t equals = line.find('=');
        if (equals == line.npos) fail<InputError>(path, "is not a MetaImage file");
        header.fields[to_lower(trimmed(line.substr(0, equals)))] = trimmed(line.substr(equals + 1));
    }
    if (!header.fields.contains("elementdatafile")) {
        fail<InputError>(path, "is not a MetaImage file: it has no ElementDataFile");
    }
    header.end = text.size() - rest.size();
    if (starts_with_word(header.fields["elementdatafile"], "list")) {
        while (!rest.empty()) {
            const std::string_view line = trimmed(take_line(rest));
            if (!line.empty()) header.listed_files.emplace_back(line);
        }
    }
    return header;
}

StoredType stored_type(const Header& header) {
    static constexpr TypeName kNames[] = {
        {"met_char", StoredType::int8},
        {"met_uchar", StoredType::uint8},
        {"met_short", StoredType::int16},
        {"met_ushort", StoredType::uint16},
        {"met_int|met_long", StoredType::int32},
        {"met_uint|met_ulong", StoredType::uint32},  // a long has four bytes, on every machine
        {"met_long_long", StoredType::int64},
        {"met_ulong_long", StoredType::uint64},
        {"met_float", StoredType::float32},
        {"met_double", StoredType::float64}};
    const std::string* text = header.find({"elementtype"});
    if (!text) header.refuse("ElementType is missing");
    const std::optional<StoredType> type = find_type(kNames, to_lower(*text));
    if (!type) header.refuse(fmt::format("samples of type {} are not supported", quoted(*text)));
    return *type;
}

// Returns the number of volumes: the product of the sizes after the third.
double read_geometry(const Header& header, RawImage& image) {
    const std::string* text = header.find({"ndims"});
    const auto axes = text ? parse_integer(*text) : std::nullopt;
    if (!axes || *axes < 1 || *axes > 10) header.refuse("NDims is missing or not a number from 1 to 10");
    const auto n = static_cast<std::size_t>(*axes);
    text = header.find({"dimsize"});
    if (!text) header.refuse("DimSize is missing");
    const auto sizes = header.numbers(*text, n);
    double volumes = 1;
    for (std::size_t a = 0; a < n; ++a) {
        if (!(sizes[a] >= 1) || sizes[a] != std::floor(sizes[a]) || sizes[a] > 9e15)
            header.refuse("DimSize has a value that is not a size");
        if (a >= 3) volumes *= sizes[a];
    }
    if (n < 3) header.refuse("is not three-dimensional");

    Mat3d m{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    if ((text = header.find({"transformmatrix", "rotation", "orientation"}))) {
        const auto values = header.numbers(*text, n * n);
        for (int axis = 0; axis < 3; ++axis) {  // the file lists the direction of each axis
            for (int row = 0; row < 3; ++row) m[row][axis] = values[static_cast<std::size_t>(axis) * n + row];
        }
    } else {
        image.oriented = false;
    }
    double mm = 1;
    if ((text = header.find({"distanceunits"})) && *text != "?") {
        const auto known = millimetres(*text);
        if (!known) header.refuse(fmt::format("the unit {} is unknown", quoted(*text)));
        mm = *known;
    }
    std::vector<double> spacing(n, 1 / mm);
    if ((text = header.find({"elementspacing", "elementsize"})))
        spacing = header.numbers(*text, n);
    else
        image.has_spacing = false;
    Geometry& g = image.geometry;
    if ((text = header.find({"offset", "position", "origin"}))) {
        const auto values = header.numbers(*text, n);
        for (int row = 0; row < 3; ++row) g.origin[row] = values[row] * mm;
    }
    for (int axis = 0; axis < 3; ++axis) {
        g.dims[axis] = static_cast<std::int64_t>(sizes[axis]);
        if (!(spacing[axis] > 0)) header.refuse("ElementSpacing is not positive");
        for (int row = 0; row < 3; ++row) m[row][axis] *= spacing[axis] * mm;
    }
    set_columns(g, m);
    return volumes;
}

void read_data_location(const Header& header, RawImage& image) {
    if (!header.flag({"binarydata"}, true))
        header.refuse("samples as text are not supported; save it as binary");
    image.compressed = header.flag({"compresseddata"}, false);
    image.big_endian = header.flag({"binarydatabyteordermsb", "elementbyteordermsb"}, false);

    const std::string& name = *header.find({"elementdatafile"});
    if (to_lower(name) == "local") {
        image.files = {header.path};
        image.file_offset = static_cast<std::int64_t>(header.end);
    } else if (starts_with_word(name, "list")) {
        if (header.listed_files.empty()) header.refuse("lists no data file");
        for (const auto& file : header.listed_files) image.files.push_back(sibling_path(header.path, file));
    } else if (name.find('%') != name.npos) {
        header.refuse("a file name pattern is not supported; use LIST");
    } else {
        image.files = {sibling_path(header.path, name)};
    }
    if (const std::string* text = header.find({"headersize"})) {
        const auto size = parse_integer(*text);
        if (!size || *size < -1 || (*size == -1 && image.compressed))
            header.refuse("HeaderSize is not a size");
        // It counts from the beginning of the file, also if that is the header's own; 0 states nothing.
        if (*size > 0 && *size < *image.file_offset) header.refuse("HeaderSize ends within the header");
        if (*size == -1)
            image.file_offset.reset();
        else if (*size > 0)
            image.file_offset = *size;
    }
}

}  // namespace

RawImage read_metaimage_header(const std::filesystem::path& path, std::optional<std::int64_t> volume) {
    const Header header = parse(path);
    if (const std::string* object = header.find({"objecttype"}); object && to_lower(*object) != "image") {
        header.refuse(fmt::format("holds an object of type {}, not an image", quoted(*object)));
    }
    if (const std::string* channels = header.find({"elementnumberofchannels"});
        channels && parse_integer(*channels) != 1) {
        header.refuse(
            fmt::format("has {} values per point; only one value per point is supported", quoted(*channels)));
    }
    RawImage image;
    image.type = stored_type(header);
    const double volumes = read_geometry(header, image);
    read_data_location(header, image);
    choose_volume(image, volumes, volume);
    return image;
}

}  // namespace marrow::internal::io
