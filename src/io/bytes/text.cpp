#include "text.h"

#include <fmt/format.h>

#include <charconv>

#include <marrow/error.h>

namespace marrow {

namespace {

constexpr std::string_view white = " \t\r\n\v\f";

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

std::string shown(std::string_view text) {
    constexpr std::size_t longest = 300;
    std::string out = "'";
    for (const char c : text.substr(0, longest)) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7f)
            out += fmt::format("\\x{:02x}", byte);
        else
            out += c;
    }
    return out + (text.size() > longest ? "...'" : "'");
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(white);
    if (first == text.npos) return {};
    return text.substr(first, text.find_last_not_of(white) - first + 1);
}

std::string lower(std::string_view text) {
    std::string out(text);
    for (char& c : out) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return out;
}

std::vector<std::string_view> words(std::string_view text) {
    std::vector<std::string_view> out;
    for (std::size_t at = text.find_first_not_of(white); at != text.npos;) {
        const std::size_t end = std::min(text.find_first_of(white, at), text.size());
        out.push_back(text.substr(at, end - at));
        at = text.find_first_not_of(white, end);
    }
    return out;
}

std::optional<double> number(std::string_view text) {
    return parse<double>(text);
}

std::optional<std::int64_t> integer(std::string_view text) {
    return parse<std::int64_t>(text);
}

std::optional<double> millimetres(std::string_view unit) {
    const std::string u = lower(trimmed(unit));
    if (u == "mm" || u == "millimeter" || u == "millimetre") return 1.0;
    if (u == "um" || u == "\xc2\xb5m" || u == "micron" || u == "micrometer") return 1e-3;
    if (u == "cm" || u == "centimeter" || u == "centimetre") return 10.0;
    if (u == "m" || u == "meter" || u == "metre") return 1e3;
    return {};
}

std::string ending(const std::filesystem::path& path) {
    const std::string last = lower(path.extension().native());
    if (last != ".gz") return last;
    return lower(path.stem().extension().native()) + last;
}

std::filesystem::path beside(const std::filesystem::path& header, std::string_view name) {
    const std::filesystem::path folder = header.parent_path();
    const std::filesystem::path named = std::filesystem::path(trimmed(name)).lexically_normal();
    const auto lies_within = [](const std::filesystem::path& relative) {
        return !relative.empty() && !relative.is_absolute() && *relative.begin() != "..";
    };
    // a symbolic link must not lead out of the folder either
    std::error_code error;
    const auto real_folder = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
    const auto real_file = std::filesystem::weakly_canonical(folder / named, error);
    if (error || !lies_within(named) || !lies_within(real_file.lexically_relative(real_folder))) {
        throw InputError(
            fmt::format("{}: its data file {} is not in the header's folder; put both into one folder",
                        shown(header), shown(name)));
    }
    return folder / named;
}

}  // namespace marrow
