/// The mesh formats of the export, and the command lines that write the same files.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <QString>

#include <marrow/mesh_io.h>

#include "session.h"

namespace marrow::viewer {

struct ExportFormat {
    const char* extension;
    const char* name;
};

/// The formats that the library writes.
inline constexpr std::array<ExportFormat, 6> kExportFormats{{
    {".stl", "STL, for 3D printing"},
    {".3mf", "3MF, for 3D printing, with name and colour"},
    {".ply", "PLY, with normals"},
    {".obj", "OBJ, plain text"},
    {".vtp", "VTP, for ParaView and 3D Slicer"},
    {".glb", "GLB, for the web, with name and colour"},
}};

/// The approximate size of the file, with how far the surface can be `trust`ed;
/// nothing for compressed formats.
std::optional<double> estimated_bytes(const std::string& extension, std::size_t points, std::size_t triangles,
                                      bool trust);
/// The size as text, such as "12.3 MB".
QString size_text(double bytes);

/// The surface with the name and colour that the command line gives it.
MeshObject export_object(const Scan& scan, const Parameters& parameters, const SurfaceParameters& surface,
                         const Mesh& mesh);

/// The arguments for `marrow` that write this surface to `output`.
std::vector<std::string> command_arguments(const Scan& scan, const Parameters& parameters,
                                           const SurfaceParameters& surface,
                                           const std::filesystem::path& output, Space space);
/// The command line for a shell: `marrow` and the quoted arguments.
QString shell_line(const std::vector<std::string>& arguments);

/// A file name from the name of the surface, without characters that are special to shells or file systems.
QString file_name(const Scan& scan, const SurfaceParameters& surface, const std::string& extension);

}  // namespace marrow::viewer
