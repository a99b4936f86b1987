// Reads NRRD headers, attached (.nrrd) and detached (.nhdr). See
// http://teem.sourceforge.net/nrrd/format.html.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <marrow/error.h>

#include "io/bytes/byte_stream.h"
#include "io/bytes/text.h"
#include "raw_image.h"

namespace marrow::internal::io {

namespace {

using Fields = std::map<std::string, std::string>;

struct Header {
    std::filesystem::path path;
    Fields fields, keys;
    std::vector<std::string> listed_files;  // lines after "data file: LIST"
    std::size_t end = 0;                    // offset of the data after an attached header

    [[noreturn]] void refuse(std::string_view why) const { fail<InputError>(path, "NRRD header: {}", why); }
    // The text of a field, if it is present.
    std::optional<std::string_view> find(const char* name) const {
        const auto at = fields.find(name);
        if (at == fields.end()) return {};
        return at->second;
    }
    std::string_view require(const char* name) const {
        const auto text = find(name);
        if (!text) refuse(fmt::format("the field '{}' is missing", name));
        return *text;
    }
};

// Some fields have two spellings.
std::string field_name(std::string_view name) {
    const std::string n = to_lower(trimmed(name));
    if (n == "datafile") return "data file";
    if (n == "lineskip") return "line skip";
    if (n == "byteskip") return "byte skip";
    if (n == "centerings") return "centers";
    if (n == "axismins") return "axis mins";
    return n;
}

// In keys and their values, two backslashes stand for one, and a backslash before an n for a new line.
std::string unescaped(std::string_view text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool escapes =
            text[i] == '\\' && i + 1 < text.size() && (text[i + 1] == '\\' || text[i + 1] == 'n');
        if (!escapes)
            out += text[i];
        else
            out += text[++i] == 'n' ? '\n' : '\\';
    }
    return out;
}

Header parse(const std::filesystem::path& path) {
    constexpr std::size_t kLongest = 1 << 20;
    const std::string text = read_head(path, kLongest);
    Header header{path, {}, {}, {}, 0};
    if (!text.starts_with("NRRD000")) fail<InputError>(path, "is not a NRRD file");

    bool in_list = false;
    std::string_view rest = text;
    take_line(rest);
    while (!rest.empty()) {
        if (rest.find('\n') == rest.npos && text.size() == kLongest) header.refuse("is longer than 1 MiB");
        const std::string_view line = trimmed(take_line(rest));
        header.end = text.size() - rest.size();
        if (line.starts_with('#')) continue;
        if (in_list) {
            if (!line.empty()) header.listed_files.emplace_back(line);
            continue;
        }
        if (line.empty()) break;
        // A key may have a colon.
        if (const std::size_t equals = line.find(":="); equals < line.find(": ")) {
            header.keys.emplace(unescaped(line.substr(0, equals)), unescaped(line.substr(equals + 2)));
            continue;
        }
        const std::size_t colon = line.find(':');
        if (colon == line.npos) header.refuse(fmt::format("cannot parse the line {}", quoted(line)));
        const std::string name = field_name(line.substr(0, colon));
        const std::string_view value = trimmed(line.substr(colon + 1));
        if (!header.fields.emplace(name, value).second)
            header.refuse(fmt::format("the field {} occurs twice", quoted(name)));
        in_list = name == "data file" && starts_with_word(value, "list");
    }
    return header;
}

StoredType stored_type(const Header& header) {
    static constexpr TypeName kNames[] = {
        {"signed char|int8|int8_t", StoredType::int8},
        {"uchar|unsigned char|uint8|uint8_t", StoredType::uint8},
        {"short|short int|signed short|signed short int|int16|int16_t", StoredType::int16},
        {"ushort|unsigned short|unsigned short int|uint16|uint16_t", StoredType::uint16},
        {"int|signed int|int32|int32_t", StoredType::int32},
        {"uint|unsigned int|uint32|uint32_t", StoredType::uint32},
        {"longlong|long long|long long int|signed long long|signed long long int|int64|int64_t",
         StoredType::int64},
        {"ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t", StoredType::uint64},
        {"float", StoredType::float32},
        {"double", StoredType::float64}};
    const std::optional<StoredType> type = find_type(kNames, to_lower(header.require("type")));
    if (!type)
        header.refuse(fmt::format("samples of type {} are not supported", quoted(header.require("type"))));
    return *type;
}

// Parses one number for each axis.
std::vector<double> numbers(const Header& header, const char* name, std::size_t axes) {
    std::vector<double> out;
    for (const auto word : split(header.require(name))) {
        const auto value = parse_double(word);
        if (!value) header.refuse(fmt::format("'{}' has {}, which is not a number", name, quoted(word)));
        out.push_back(*value);
    }
    if (out.size() != axes)
        header.refuse(fmt::format("'{}' has {} values for {} axes", name, out.size(), axes));
    return out;
}

// Parses "(x,y,z)".
Vec3d vector(const Header& header, std::string_view text) {
    Vec3d out{};
    const std::string_view whole = text;
    text = trimmed(text);
    bool good = text.starts_with('(') && text.ends_with(')');
    if (good) text = text.substr(1, text.size() - 2);
    for (int i = 0; i < 3 && good; ++i) {
        const std::size_t comma = i < 2 ? text.find(',') : text.size();
        const auto value = comma == text.npos ? std::nullopt : parse_double(text.substr(0, comma));
        good = value.has_value();
        if (good) out[i] = *value;
        if (good && i < 2) text.remove_prefix(comma + 1);
    }
    if (!good) header.refuse(fmt::format("{} is not a vector of three numbers", quoted(whole)));
    return out;
}

// Parses "(1,0,0) none (0,0,1)". There may be white space inside the brackets too.
std::vector<std::optional<Vec3d>> directions(const Header& header, std::size_t axes) {
    std::vector<std::optional<Vec3d>> out;
    std::string_view rest = trimmed(header.require("space directions"));
    while (!rest.empty()) {
        if (to_lower(rest.substr(0, 4)) == "none") {
            out.emplace_back();
            rest = trimmed(rest.substr(4));
        } else {
            const std::size_t close = std::min(rest.find(')'), rest.size() - 1);
            out.emplace_back(vector(header, rest.substr(0, close + 1)));
            rest = trimmed(rest.substr(close + 1));
        }
    }
    if (out.size() != axes)
        header.refuse(fmt::format("'space directions' has {} values for {} axes", out.size(), axes));
    return out;
}

// Returns the words in quotes: "mm" "mm" "mm".
std::vector<std::string_view> quoted_words(std::string_view text) {
    std::vector<std::string_view> out;
    for (std::size_t open = text.find('"'); open != text.npos;) {
        const std::size_t close = text.find('"', open + 1);
        if (close == text.npos) break;
        out.push_back(text.substr(open + 1, close - open - 1));
        open = text.find('"', close + 1);
    }
    return out;
}

double unit(const Header& header, std::string_view name) {
    if (trimmed(name).empty() || name == "???") return 1;
    const auto mm = millimetres(name);
    if (!mm) header.refuse(fmt::format("the unit {} is unknown", quoted(name)));
    return *mm;
}

// The signs that convert the header's space to LPS.
Vec3d to_lps(const Header& header, RawImage& image) {
    const auto space = header.find("space");
    if (!space) {
        image.oriented = false;
        image.warnings.push_back(
            "the NRRD header names no space; its axes are assumed to be left, posterior, superior");
        return {1, 1, 1};
    }
    const std::string name = to_lower(*space);
    if (name == "left-posterior-superior" || name == "lps") return {1, 1, 1};
    if (name == "right-anterior-superior" || name == "ras") return {-1, -1, 1};
    if (name == "left-anterior-superior" || name == "las") return {1, -1, 1};
    if (name == "scanner-xyz" || name == "3d-right-handed" || name == "3d-left-handed") {
        // LPS is right-handed: one axis is negated, so that the body is not mirrored.
        const bool mirrored = name == "3d-left-handed";
        image.oriented = false;
        image.warnings.push_back(
            fmt::format("the space '{}' does not state the orientation; its axes are assumed to be left, "
                        "posterior, {}",
                        name, mirrored ? "inferior" : "superior"));
        return {1, 1, mirrored ? -1.0 : 1.0};
    }
    header.refuse(fmt::format("the space {} is not supported", quoted(*space)));
}

// Red, green and blue from 0 to 1.
std::optional<std::array<double, 3>> colour(std::string_view text) {
    const auto words = split(text);
    if (words.size() != 3) return {};
    std::array<double, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto part = parse_double(words[i]);
        if (!part || !(*part >= 0 && *part <= 1)) return {};
        out[i] = *part;
    }
    return out;
}

// The segments that 3D Slicer describes by keys: Segment0_LabelValue, Segment0_Name, Segment0_Color. Those
// that overlap are in several layers, if the file has these: Segment0_Layer.
std::map<std::int64_t, LabelTable> segments_by_layer(const Header& header, bool has_layers) {
    constexpr std::string_view kBegin = "Segment", kEnd = "_LabelValue";
    const auto text = [&](const std::string& key) {
        const auto at = header.keys.find(key);
        return at == header.keys.end() ? std::string() : at->second;
    };
    std::map<std::int64_t, LabelTable> layers;
    for (const auto& [key, value] : header.keys) {
        if (!key.starts_with(kBegin) || !key.ends_with(kEnd)) continue;
        const std::string segment = key.substr(0, key.size() - kEnd.size());
        const auto label = parse_integer(value);
        if (!label) continue;
        const auto layer = has_layers ? parse_integer(text(segment + "_Layer")) : std::nullopt;
        layers[layer.value_or(0)].emplace(
            *label, LabelEntry{text(segment + "_Name"), colour(text(segment + "_Color"))});
    }
    return layers;
}

// What the layers of a segmentation hold: "segments liver, 3".
std::vector<std::string> describe(const std::map<std::int64_t, LabelTable>& layers, double count) {
    constexpr double kMostLayers = 1000;
    std::vector<std::string> out;
    for (std::int64_t layer = 0; static_cast<double>(layer) < std::min(count, kMostLayers); ++layer) {
        const auto found = layers.find(layer);
        std::vector<std::string> names;
        if (found != layers.end()) {
            for (const auto& [label, entry] : found->second)
                names.push_back(entry.name.empty() ? std::to_string(label) : entry.name);
        }
        out.push_back(names.empty() ? "no segments" : fmt::format("segments {}", fmt::join(names, ", ")));
    }
    return out;
}

struct Axes {
    std::array<std::size_t, 3> space{};
    std::optional<std::size_t> volumes;  // one value for each of several volumes
};

// Axes with a single value are passed over.
Axes find_axes(const Header& header, const std::vector<double>& sizes,
               const std::vector<std::optional<Vec3d>>& known_directions) {
    const std::size_t axes = sizes.size();
    static const std::vector<std::string> spatial = {"domain", "space", "???", "none"};
    const auto kinds =
        header.find("kinds") ? split(*header.find("kinds")) : std::vector<std::string_view>(axes, "???");
    if (kinds.size() != axes)
        header.refuse(fmt::format("'kinds' has {} values for {} axes", kinds.size(), axes));
    // If only their spacing tells axes apart, one without a spacing is not an axis of space if it has one
    // sample or three others have a spacing.
    const bool by_spacing = known_directions.empty() && !header.find("kinds");
    const auto spacings = by_spacing && header.find("spacings") ? numbers(header, "spacings", axes)
                                                                : std::vector<double>(axes, NAN);
    const bool three_spacings =
        std::count_if(spacings.begin(), spacings.end(), [](double s) { return !std::isnan(s); }) >= 3;
    std::size_t left = axes;
    std::vector<std::size_t> space, others;
    for (std::size_t a = 0; a < axes; ++a) {
        const bool without_spacing =
            by_spacing && left > 3 && std::isnan(spacings[a]) && (sizes[a] == 1 || three_spacings);
        if (without_spacing) --left;
        const std::string kind = to_lower(kinds[a]);
        const bool of_space = std::find(spatial.begin(), spatial.end(), kind) != spatial.end();
        const bool in_space = !without_spacing && (known_directions.empty() || known_directions[a]);
        if (in_space && of_space && (axes == 3 || space.size() < 3)) {
            space.push_back(a);
        } else if (sizes[a] != 1) {
            if (!of_space && kind != "list" && kind != "time")
                header.refuse(fmt::format(
                    "axis {} has {:.0f} values per point (kind {}); only one value per point is supported", a,
                    sizes[a], quoted(kinds[a])));
            others.push_back(a);
        }
    }
    if (space.size() != 3) header.refuse("is not three-dimensional");
    if (others.size() > 1 || (others.size() == 1 && others[0] > space[0] && others[0] < space[2]))
        header.refuse("besides three axes of space, only one other is supported, as the first or the last");
    return {{space[0], space[1], space[2]},
            others.empty() ? std::nullopt : std::optional<std::size_t>(others[0])};
}

// Spacing and origin of headers without space directions, in mm. An axis without a unit of its own has that
// of space.
void read_spacings(const Header& header, std::size_t axes, const std::array<std::size_t, 3>& space,
                   const Vec3d& space_unit, RawImage& image, Mat3d& m, Vec3d& origin) {
    const auto units =
        header.find("units") ? quoted_words(*header.find("units")) : std::vector<std::string_view>(axes, "");
    if (units.size() != axes) header.refuse("'units' needs one unit in quotes for each axis");
    const auto spacings =
        header.find("spacings") ? numbers(header, "spacings", axes) : std::vector<double>(axes, NAN);
    const auto mins =
        header.find("axis mins") ? numbers(header, "axis mins", axes) : std::vector<double>(axes, NAN);
    const auto centers =
        header.find("centers") ? split(*header.find("centers")) : std::vector<std::string_view>(axes, "???");
    if (centers.size() != axes)
        header.refuse(fmt::format("'centers' has {} values for {} axes", centers.size(), axes));
    for (int i = 0; i < 3; ++i) {
        const std::size_t a = space[i];
        const double mm = trimmed(units[a]).empty() ? space_unit[i] : unit(header, units[a]);
        if (std::isnan(spacings[a]))
            image.has_spacing = false;
        else if (!(spacings[a] > 0))
            header.refuse("'spacings' has a value that is not positive");
        m[i][i] = std::isnan(spacings[a]) ? 1 : spacings[a] * mm;
        // The minimum is the position of the first sample, or of the outer face of its cell.
        if (!std::isnan(mins[a]))
            origin[i] = mins[a] * mm + (to_lower(centers[a]) == "cell" ? m[i][i] / 2 : 0);
    }
}

// Returns the axis of volumes, if there are several.
std::optional<std::size_t> read_geometry(const Header& header, const std::vector<double>& sizes,
                                         RawImage& image) {
    const std::size_t axes = sizes.size();
    const auto known =
        header.find("space directions") ? directions(header, axes) : std::vector<std::optional<Vec3d>>();
    const auto [space, volumes] = find_axes(header, sizes, known);
    const Vec3d sign = to_lps(header, image);
    Vec3d space_unit{1, 1, 1};
    if (const auto units = header.find("space units")) {
        const auto names = quoted_words(*units);
        if (names.size() != 3) header.refuse("'space units' needs three units in quotes");
        for (int row = 0; row < 3; ++row) space_unit[row] = unit(header, names[row]);
    }

    Geometry& g = image.geometry;
    for (int i = 0; i < 3; ++i) g.dims[i] = static_cast<std::int64_t>(sizes[space[i]]);
    Mat3d m{};
    Vec3d origin{};
    if (known.empty()) {
        read_spacings(header, axes, space, space_unit, image, m, origin);
    } else {
        for (int i = 0; i < 3; ++i) {
            for (int row = 0; row < 3; ++row) m[row][i] = (*known[space[i]])[row] * space_unit[row];
        }
    }
    if (const auto text = header.find("space origin")) {
        origin = vector(header, *text);
        for (int row = 0; row < 3; ++row) origin[row] *= space_unit[row];
    }
    for (int row = 0; row < 3; ++row) {
        for (int i = 0; i < 3; ++i) m[row][i] *= sign[row];
        g.origin[row] = origin[row] * sign[row];
    }
    set_columns(g, m);
    image.interleaved = volumes && *volumes < space[0];
    return volumes;
}

// Expands "name%03d.raw 1 93 1" to the names with the numbers 1 to 93.
std::vector<std::string> pattern_files(const Header& header, const std::vector<std::string_view>& parts,
                                       double most) {
    const auto number = [&](std::size_t part) {
        constexpr std::int64_t kLargest = 1'000'000'000'000'000'000;  // so that sums do not overflow
        const auto value = parse_integer(parts[part]);
        return value && *value >= -kLargest && *value <= kLargest ? value : std::nullopt;
    };
    const auto first = number(1), last = number(2), step = number(3);
    constexpr double kMostFiles = 1e6;
    if (!first || !last || !step || *step == 0 || (*last - *first) / *step < 0 ||
        static_cast<double>((*last - *first) / *step) >= std::min(most, kMostFiles)) {
        header.refuse(fmt::format("'data file' has no valid range of numbers: {}",
                                  quoted(header.require("data file"))));
    }
    const std::string_view name = parts[0];
    const std::size_t percent = name.find('%');
    const std::size_t letter =
        percent == name.npos ? name.npos : name.find_first_not_of("0123456789", percent + 1);
    const std::string_view width = letter == name.npos ? "" : name.substr(percent + 1, letter - percent - 1);
    if (letter == name.npos || (name[letter] != 'd' && name[letter] != 'u') || width.size() > 2 ||
        name.find('%', letter) != name.npos) {
        header.refuse(fmt::format("'data file' has no number like %03d: {}", quoted(name)));
    }
    const char fill = width.starts_with('0') ? '0' : ' ';
    const std::size_t least = static_cast<std::size_t>(parse_integer(width).value_or(0));
    std::vector<std::string> out;
    for (std::int64_t n = *first; *step > 0 ? n <= *last : n >= *last; n += *step) {
        std::string digits = std::to_string(n);
        if (digits.size() < least) digits.insert(0, least - digits.size(), fill);
        out.push_back(fmt::format("{}{}{}", name.substr(0, percent), digits, name.substr(letter + 1)));
    }
    return out;
}

void read_data_location(const Header& header, RawImage& image) {
    const std::string encoding = to_lower(header.require("encoding"));
    if (encoding == "gzip" || encoding == "gz")
        image.compressed = true;
    else if (encoding != "raw")
        header.refuse(
            fmt::format("the encoding {} is not supported; save it as raw or gzip", quoted(encoding)));

    const auto data_file = header.find("data file");
    if (!data_file) {
        image.files = {header.path};
        image.file_offset = static_cast<std::int64_t>(header.end);
    } else {
        const auto parts = split(*data_file);
        std::vector<std::string> names;
        if (starts_with_word(*data_file, "list"))
            names = header.listed_files;
        else if (parts.size() >= 4 && parts[0].find('%') != parts[0].npos) {
            // The fifth word is the number of axes that a file holds: 1 if it has a row of samples.
            const bool is_row = parts.size() > 4 && parse_integer(parts[4]) == 1;
            const auto& dims = image.geometry.dims;
            names = pattern_files(header, parts,
                                  static_cast<double>(dims[2]) * (is_row ? static_cast<double>(dims[1]) : 1));
        } else
            names = {std::string(*data_file)};
        if (names.empty()) header.refuse("names no data file");
        for (const auto& name : names) image.files.push_back(sibling_path(header.path, name));
    }

    const auto skip = [&](const char* name) {
        const auto text = header.find(name);
        const auto value = text ? parse_integer(*text) : 0;
        if (!value || *value < -1)
            header.refuse(fmt::format("'{}' is not a number of bytes or lines: {}", name, quoted(*text)));
        return *value;
    };
    if (skip("line skip") != 0) header.refuse("'line skip' is not supported; use 'byte skip'");
    const std::int64_t bytes = skip("byte skip");
    if (bytes == -1) {
        if (image.compressed) header.refuse("'byte skip: -1' needs the encoding raw");
        image.file_offset.reset();
    } else {
        image.data_offset = bytes;
    }
}

}  // namespace

RawImage read_nrrd_header(const std::filesystem::path& path, std::optional<std::int64_t> volume) {
    const Header header = parse(path);
    RawImage image;
    image.type = stored_type(header);

    const auto axes = parse_integer(header.require("dimension"));
    if (!axes || *axes < 1 || *axes > 16) header.refuse("'dimension' is not a number from 1 to 16");
    const auto sizes = numbers(header, "sizes", static_cast<std::size_t>(*axes));
    for (const double size : sizes) {
        if (!(size >= 1) || size != std::floor(size) || size > 9e15)
            header.refuse("'sizes' has a value that is not a size");
    }
    const std::optional<std::size_t> volumes = read_geometry(header, sizes, image);
    read_data_location(header, image);
    const double count = volumes ? sizes[*volumes] : 1;
    std::map<std::int64_t, LabelTable> layers = segments_by_layer(header, volumes.has_value());
    if (volumes && !layers.empty()) image.volume_names = describe(layers, count);
    choose_volume(image, count, volume);
    image.labels = std::move(layers[image.volume]);

    const bool bytes = image.type == StoredType::uint8 || image.type == StoredType::int8;
    const std::string endian = bytes ? "little" : to_lower(header.require("endian"));
    if (endian != "little" && endian != "big") header.refuse("'endian' is neither little nor big");
    image.big_endian = endian == "big";
    return image;
}

}  // namespace marrow::internal::io
