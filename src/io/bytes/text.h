/// Parses the text of headers, and quotes names for error messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include <marrow/error.h>

namespace marrow::internal::io {

/// The first character of a text that is not empty, in UTF-8.
struct Character {
    std::string_view bytes;  ///< a single one if it is not valid
    bool is_valid = false;   ///< false also for surrogates, U+FFFE, U+FFFF and the like
    bool is_control = false;
};
Character first_character(std::string_view text);

/// A path or a word of a file in quotes, for a message: control characters and bytes that are not UTF-8 are
/// escaped, long text loses its middle.
std::string quoted(std::string_view text);
inline std::string quoted(const std::string& text) {
    return quoted(std::string_view(text));
}
inline std::string quoted(const std::filesystem::path& path) {
    return quoted(std::string_view(path.native()));
}

/// Throws an error about a file: "'<path>': <why>". `why` is formatted with the values.
template <class E, class... T>
[[noreturn]] void fail(const std::filesystem::path& path, fmt::format_string<T...> why, T&&... values) {
    throw E(quoted(path) + ": " + fmt::format(why, std::forward<T>(values)...));
}

/// The first few items for a message, as far as a line has room: "a; b; and 3 more".
std::string examples(const std::vector<std::string>& items);

/// A number of things, whose name takes an "s" in the plural: "1 file", "2 files".
std::string count_of(std::uint64_t count, std::string_view thing);

std::string_view trimmed(std::string_view text);
std::string to_lower(std::string_view text);
/// The words between white space.
std::vector<std::string_view> split(std::string_view text);
/// Removes the first word from `text`, and the white space before it, and returns it; empty at the end.
std::string_view take_word(std::string_view& text);
/// Whether the first word of a text, in any case, is this one, which is in lower case.
bool starts_with_word(std::string_view text, std::string_view word);
/// Removes the first line from `text` and returns it without its newline.
std::string_view take_line(std::string_view& text);

/// The number that the trimmed text consists of, in any locale; NaN and inf count. No value if it is not a
/// number.
std::optional<double> parse_double(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);

/// How many millimetres a unit of length has ("mm", "um", "cm", "m", ..., and the names that OME-Zarr knows).
/// No value if it is unknown.
std::optional<double> millimetres(std::string_view unit);

/// The extension in lower case: ".nrrd". ".nii.gz" counts as one extension.
std::string extension(const std::filesystem::path& path);

/// The path of a data file that a header names: in the header's folder or below it.
/// \throw InputError the name or a symbolic link leaves that folder
std::filesystem::path sibling_path(const std::filesystem::path& header, std::string_view name);

}  // namespace marrow::internal::io
