// Parses the text of headers, and quotes names for error messages.
#include "text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include <marrow/error.h>

namespace marrow::internal::io {

namespace {

bool is_white(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
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

std::string quoted(std::string_view text) {
    // The end of a long path is its file name.
    constexpr std::size_t kMost = 160, kFirst = 40;
    const bool is_long = text.size() > kMost;
    std::string out = "'";
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (is_long && i == kFirst) {
            out += "...";
            i = text.size() - (kMost - kFirst);
        }
        const auto byte = static_cast<unsigned char>(text[i]);
        if (byte < 0x20 || byte == 0x7f)
            out += fmt::format("\\x{:02x}", byte);
        else
            out += text[i];
    }
    return out + "'";
}

std::string examples(const std::vector<std::string>& items) {
    constexpr std::size_t kMost = 3, kLongest = 150;
    std::string out;
    for (std::size_t i = 0; i < std::min(items.size(), kMost); ++i) {
        if (i > 0 && out.size() + items[i].size() > kLongest) break;
        out += (i > 0 ? "; " : "") + items[i];
    }
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
    const std::string u = to_lower(trimmed(unit));
    if (u == "mm" || u == "millimeter" || u == "millimetre") return 1.0;
    if (u == "um" || u == "\xc2\xb5m" || u == "micron" || u == "micrometer" || u == "micrometre") return 1e-3;
    if (u == "cm" || u == "centimeter" || u == "centimetre") return 10.0;
    if (u == "m" || u == "meter" || u == "metre") return 1e3;
    if (u == "nm" || u == "nanometer" || u == "nanometre") return 1e-6;
    if (u == "angstrom") return 1e-7;
    return {};
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
