/// How an input of the target `zarr` holds the files of a folder: each begins with a
/// mark and the number of its name.
#pragma once

#include <string>
#include <string_view>

inline constexpr const char* kZarrFiles[] = {"zarr.json",   ".zattrs",   ".zarray", "0/zarr.json",
                                             "0/.zarray",   "c/0/0/0",   "c/0/0/1", "0.0.0",
                                             "0/c/0/0/0/0", "0/0/0/0/0", ".zgroup", "0/0.0.0.0"};
inline constexpr std::string_view kZarrMark = "\xff\xfe";

inline std::string zarr_file(std::string_view name, std::string_view content) {
    char number = 0;
    while (kZarrFiles[static_cast<std::size_t>(number)] != name) ++number;
    return std::string(kZarrMark) + number + std::string(content);
}
