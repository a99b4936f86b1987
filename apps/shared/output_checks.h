/// Checks of outputs that both programs make before they write.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

namespace marrow::apps {

/// Checks an output before the work starts. An empty path is no file.
/// \throw IoError its folder does not exist; UsageError it would overwrite `input` or a file of it
void check_output(const std::filesystem::path& file, const std::filesystem::path& input);

/// Checks that none of these outputs is a file that the scan was read from. \throw UsageError
void check_not_read(const std::vector<std::filesystem::path>& files,
                    const std::vector<std::filesystem::path>& scan_files);

/// Checks that a picture will not be a slice when `input`, a folder of slices, is read again. An empty path
/// is no picture. \throw UsageError
void check_is_no_slice(const std::filesystem::path& picture, const std::filesystem::path& input,
                       ScanFormat format);

/// What stands for the name of each surface in an output.
inline constexpr std::string_view kNamePlaceholder = "{name}";

/// Whether a path has this placeholder, or its file name any other text in braces.
bool has_placeholder(const std::filesystem::path& file);

/// Whether the axes of this format are fixed, so that no other space than LPS can be chosen.
bool has_fixed_axes(MeshFormat format);

}  // namespace marrow::apps
