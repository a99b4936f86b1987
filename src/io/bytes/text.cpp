// Parses the text of headers, and quotes names for error messages.
#include "text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include <marrow/error.h>
#include <marrow/printable.h>

namespace marrow::internal::io {

namespace {

bool is_white(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

// Whether a byte is one of a character in UTF-8, but not the first.
bool is_continuation(char byte) {
    return (static_cast<unsigned char>(byte) & 0xc0) == 0x80;
}

// The number of bytes of the first character; 0 if it is not valid UTF-8.
std::size_t length_of_character(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned lead = byte(0);
    if (lead < 0x80) return 1;
    const std::size_t length = lead >= 0xc2 && lead < 0xe0   ? 2
                               : lead >= 0xe0 && lead < 0xf0 ? 3
                               : lead >= 0xf0 && lead < 0xf5 ? 4
                                                             : 0;
    unsigned code = lead & (0xffu >> (length + 1));
    for (std::size_t i = 1; i < length; ++i) {
        if (i >= text.size() || !is_continuation(text[i])) return 0;
        code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr unsigned kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    const bool surrogate = code >= 0xd800 && code < 0xe000, noncharacter = (code & 0xfffe) == 0xfffe;
    return code >= kLeast[length] && code <= 0x10ffff && !surrogate && !noncharacter ? length : 0;
}

void append_printable(const Character& character, std::string& out) {
    if (character.is_valid && !character.is_control) {
        out += character.bytes;
        return;
    }
    for (const char byte : character.bytes) out += fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
}

template <class T>
std::optional<T> parse(std::string_view text) {
    text = trimmed(text);
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return {};
    return value;
}

}  // namespace

Character first_character(std::string_view text) {
    const std::size_t length = length_of_character(text);
    if (length == 0) return {text.substr(0, 1), false, false};
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const bool is_control =
        byte(0) < 0x20 || byte(0) == 0x7f || (length == 2 && byte(0) == 0xc2 && byte(1) < 0xa0);
    return {text.substr(0, length), true, is_control};
}

std::string quoted(std::string_view text) {
    // The end of a long path is its file name.
    constexpr std::size_t kMost = 160, kFirst = 40;
    std::string out = "'";
    bool whole = text.size() <= kMost;
    for (std::string_view rest = text; !rest.empty();) {
        if (!whole && text.size() - rest.size() >= kFirst) {
            whole = true;
            out += "...";
            rest = text.substr(text.size() - (kMost - kFirst));
            for (int i = 0; i < 3 && is_continuation(rest.front()); ++i) rest.remove_prefix(1);
        }
        const Character character = first_character(rest);
        rest.remove_prefix(character.bytes.size());
        append_printable(character, out);
    }
    return out + "'";
}

std::string examples(const std::vector<std::string>& items) {
    constexpr std::size_t kMost = 3, kLongest = 150;
    std::string out;
    std::size_t shown = 0;
    for (; shown < std::min(items.size(), kMost); ++shown) {
        if (shown > 0 && out.size() + items[shown].size() > kLongest) break;
        out += (shown > 0 ? "; " : "") + items[shown];
    }
    if (shown < items.size()) out += fmt::format("; and {} more", items.size() - shown);
    return out;
}

std::string count_of(std::uint64_t count, std::string_view thing) {
    return fmt::format("{} {}{}", count, thing, count == 1 ? "" : "s");
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_white(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_white(text.back())) text.remove_suffix(1);
    return text;
}

std::string to_lower(std::string_view text) {
    std::string out(text);
    for (char& c : out) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return out;
}

std::vector<std::string_view> split(std::string_view text) {
    std::vector<std::string_view> out;
    for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) out.push_back(word);
    return out;
}

std::string_view take_word(std::string_view& text) {
    std::size_t begin = 0;
    while (begin < text.size() && is_white(text[begin])) ++begin;
    std::size_t end = begin;
    while (end < text.size() && !is_white(text[end])) ++end;
    const std::string_view word = text.substr(begin, end - begin);
    text.remove_prefix(end);
    return word;
}

bool starts_with_word(std::string_view text, std::string_view word) {
    return to_lower(take_word(text)) == word;
}

std::string_view take_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line;
}

std::optional<double> parse_double(std::string_view text) {
    return parse<double>(text);
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
    return parse<std::int64_t>(text);
}

std::optional<double> millimetres(std::string_view unit) {
    // The metre and its parts and multiples, by what precedes "meter" or "metre".
    static constexpr std::pair<std::string_view, double> kMetres[] = {
        {"yocto", 1e-21}, {"zepto", 1e-18}, {"atto", 1e-15}, {"femto", 1e-12}, {"pico", 1e-9},
        {"nano", 1e-6},   {"micro", 1e-3},  {"milli", 1},    {"centi", 10},    {"deci", 100},
        {"", 1e3},        {"hecto", 1e5},   {"kilo", 1e6},   {"mega", 1e9},    {"giga", 1e12},
        {"tera", 1e15},   {"peta", 1e18},   {"exa", 1e21},   {"zetta", 1e24},  {"yotta", 1e27}};
    // Unicode has the sign of micro, and the Greek letter that looks like it.
    static constexpr std::pair<std::string_view, double> kOthers[] = {
        {"nm", 1e-6},        {"um", 1e-3},
        {"\xc2\xb5m", 1e-3}, {"\xce\xbcm", 1e-3},
        {"micron", 1e-3},    {"mm", 1},
        {"cm", 10},          {"m", 1e3},
        {"angstrom", 1e-7},  {"inch", 25.4},
        {"foot", 304.8},     {"yard", 914.4},
        {"mile", 1609344},   {"parsec", 3.0856775814913673e19}};
    const std::string name = to_lower(trimmed(unit));
    const auto find = [](const auto& units, std::string_view wanted) -> std::optional<double> {
        for (const auto& [known, mm] : units) {
            if (wanted == known) return mm;
        }
        return {};
    };
    if (!name.ends_with("meter") && !name.ends_with("metre")) return find(kOthers, name);
    return find(kMetres, std::string_view(name).substr(0, name.size() - 5));
}

std::string extension(const std::filesystem::path& path) {
    const std::string last = to_lower(path.extension().native());
    if (last != ".gz") return last;
    return to_lower(path.stem().extension().native()) + last;
}

std::filesystem::path sibling_path(const std::filesystem::path& header, std::string_view name) {
    const std::filesystem::path folder = header.parent_path();
    const std::filesystem::path named = std::filesystem::path(trimmed(name)).lexically_normal();
    const auto is_within = [](const std::filesystem::path& relative) {
        return !relative.empty() && !relative.is_absolute() && *relative.begin() != "..";
    };
    // A symbolic link must not lead out of the folder either.
    std::error_code error;
    const auto real_folder = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
    const auto real_file = std::filesystem::weakly_canonical(folder / named, error);
    if (!is_within(named))
        fail<InputError>(header, "its data file {} is not in the header's folder; put both into one folder",
                         quoted(name));
    if (error) fail<IoError>(header, "its data file {} cannot be found: {}", quoted(name), error.message());
    if (!is_within(real_file.lexically_relative(real_folder)))
        fail<InputError>(header,
                         "{} leads out of the header's folder by a symbolic link; put what it links to there",
                         quoted(name));
    return folder / named;
}

}  // namespace marrow::internal::io

std::string marrow::printable(std::string_view text) {
    std::string out;
    while (!text.empty()) {
        const internal::io::Character character = internal::io::first_character(text);
        internal::io::append_printable(character, out);
        text.remove_prefix(character.bytes.size());
    }
    return out;
}
