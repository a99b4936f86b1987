// The words and numbers of text headers, and how names from files are shown in messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace marrow {

/// A path or a word of a file for a message: in quotes, control characters escaped, long ones cut.
std::string shown(std::string_view text);
inline std::string shown(const std::string& text) {
    return shown(std::string_view(text));
}
inline std::string shown(const std::filesystem::path& path) {
    return shown(std::string_view(path.native()));
}

std::string_view trimmed(std::string_view text);
std::string lower(std::string_view text);
/// The words between white space.
std::vector<std::string_view> words(std::string_view text);

/// The whole text as a number, whatever the locale; nothing where it is not one. NaN and inf are numbers.
std::optional<double> number(std::string_view text);
std::optional<std::int64_t> integer(std::string_view text);

/// Millimetres in a unit of length ("mm", "um", "cm", "m", ...); nothing where it is unknown.
std::optional<double> millimetres(std::string_view unit);

/// The ending, in lower case: ".nrrd"; ".nii.gz" counts as one.
std::string ending(const std::filesystem::path& path);

/// A data file named in a header, beside or below that header.
/// \throw InputError where the name, or a symbolic link, leaves the header's folder.
std::filesystem::path beside(const std::filesystem::path& header, std::string_view name);

}  // namespace marrow
