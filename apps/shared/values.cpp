// Reads the values of options.
#include "values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

template <class Number>
std::optional<Number> parse_all(std::string_view text) {
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    Number value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return {};
    return value;
}

std::string range(std::int64_t least, std::int64_t most) {
    if (least == std::numeric_limits<std::int64_t>::min()) return "a whole number";
    if (most >= std::numeric_limits<int>::max()) return fmt::format("a whole number, at least {}", least);
    return fmt::format("a whole number from {} to {}", least, most);
}

template <class Integer, class To>
Value integer_between(std::string name, To& to, Integer least, Integer most) {
    return {std::move(name), range(least, most), [&to, least, most](const std::string& text) {
                const auto value = parse_all<Integer>(text);
                if (!value || *value < least || *value > most) return false;
                to = *value;
                return true;
            }};
}

template <class To>
Value number_that(std::string name, std::string expected, To& to, bool (*accepts)(double)) {
    return {std::move(name), std::move(expected), [&to, accepts](const std::string& text) {
                const auto value = parse_number(text);
                if (!value || !accepts(*value)) return false;
                to = *value;
                return true;
            }};
}

// The bytes in a unit of memory: none, "K", "KiB" or "KB", and the same with M, G and T, in any case. Only
// "KB" and its like are decimal.
std::optional<double> bytes_in(const std::string& text) {
    const std::string unit = lower_case(text);
    if (unit.empty() || unit == "b") return 1;
    const std::size_t power = std::string_view("kmgt").find(unit.front()) + 1;
    const std::string rest = unit.substr(1);
    if (power == 0 || !(rest.empty() || rest == "b" || rest == "ib")) return {};
    return std::pow(rest == "b" ? 1000 : 1024, static_cast<double>(power));
}

}  // namespace

std::string lower_case(std::string text) {
    for (char& c : text) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return text;
}

std::optional<double> parse_number(std::string_view text) {
    const auto value = parse_all<double>(text);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

bool parse_numbers(std::string_view text, double* numbers, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t comma = i + 1 < count ? text.find(',') : text.size();
        const auto value = comma == text.npos ? std::nullopt : parse_number(text.substr(0, comma));
        if (!value) return false;
        numbers[i] = *value;
        text.remove_prefix(std::min(comma + 1, text.size()));
    }
    return true;
}

Value text_value(std::string name, std::string& to) {
    return {std::move(name), "a text", [&to](const std::string& text) {
                to = text;
                return true;
            }};
}

Value text_value(std::string name, std::optional<std::string>& to) {
    return {std::move(name), "a text", [&to](const std::string& text) {
                to = text;
                return true;
            }};
}

Value file_value(std::string name, fs::path& to, std::string_view extension) {
    return {std::move(name), fmt::format("a {} file", extension), [&to, extension](const std::string& text) {
                to = text;
                return extension.empty() || to.extension() == extension;
            }};
}

Value integer_value(std::string name, int& to, int least, int most) {
    return integer_between<int>(std::move(name), to, least, most);
}

Value integer_value(std::string name, std::int64_t& to, std::int64_t least) {
    return integer_between(std::move(name), to, least, std::numeric_limits<std::int64_t>::max());
}

Value integer_value(std::string name, std::optional<std::int64_t>& to, std::int64_t least) {
    return integer_between(std::move(name), to, least, std::numeric_limits<std::int64_t>::max());
}

Value number_value(std::string name, std::string expected, double& to, bool (*accepts)(double)) {
    return number_that(std::move(name), std::move(expected), to, accepts);
}

Value number_value(std::string name, std::string expected, std::optional<double>& to,
                   bool (*accepts)(double)) {
    return number_that(std::move(name), std::move(expected), to, accepts);
}

Value spacing_value(std::optional<Vec3d>& to) {
    return {"X,Y,Z", "three positive numbers in mm, X,Y,Z", [&to](const std::string& text) {
                double spacing[3];
                if (!parse_numbers(text, spacing, 3) || *std::min_element(spacing, spacing + 3) <= 0)
                    return false;
                to = Vec3d{spacing[0], spacing[1], spacing[2]};
                return true;
            }};
}

Value memory_value(std::optional<std::size_t>& to) {
    return {"SIZE", "a size such as 800M, 4G or 4GiB", [&to](const std::string& text) {
                const std::size_t end = std::min(text.find_last_of("0123456789.") + 1, text.size());
                const auto value = parse_number(std::string_view(text).substr(0, end));
                const auto unit = bytes_in(text.substr(end));
                if (!value || !unit || *value <= 0 || *value * *unit > 1e18) return false;
                to = static_cast<std::size_t>(*value * *unit);
                return true;
            }};
}

}  // namespace marrow::apps
