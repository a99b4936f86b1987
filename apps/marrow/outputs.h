/// Names, checks, writes and verifies the files of surfaces.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <marrow/mesh_io.h>
#include <marrow/progress.h>

#include "results.h"

namespace marrow::apps {

/// The files for surfaces of these names, in order. `output` is a file, which all share; a folder, which gets
/// a .stl file for each; or a pattern with {name}. Without an output, the paths are empty.
/// \throw UsageError an unknown extension, or one file for two surfaces because they have the same name
std::vector<std::filesystem::path> files_for(const std::filesystem::path& output,
                                             const std::vector<std::string>& names);

/// Whether these files are one file that several surfaces share.
bool is_shared_file(const std::vector<std::filesystem::path>& files);

/// Whether surfaces are written as DICOM objects.
bool is_dicom_output(const std::filesystem::path& output);

/// As files_for, for surfaces of a scan. \throw UsageError several surfaces in a format that holds one, or a
/// format that cannot be written in this space
std::vector<std::filesystem::path> surface_files(const std::filesystem::path& output, Space space,
                                                 const std::vector<std::string>& names);

/// Writes each file once, with all surfaces that share it; no file appears before all are complete.
/// \throw as write_meshes
void write_surfaces(const std::vector<Surface>& surfaces, const MeshWriteOptions& options);

/// Reads each file again and compares it with its surfaces. \throw as verify
void verify_surfaces(const std::vector<Surface>& surfaces, Space space, const Progress& progress);

/// Reads a file that write_meshes made of `objects` and compares every triangle. \throw CheckFailed it
/// differs; Cancelled
void verify(std::span<const MeshObject> objects, const std::filesystem::path& file, Space space,
            const Progress& progress = {});

}  // namespace marrow::apps
