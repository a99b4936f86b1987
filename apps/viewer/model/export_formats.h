// What is written, and the command line that writes the same bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include <QString>

#include <marrow/mesh_io.h>

#include "session.h"

namespace marrow::viewer {

struct ExportFormat {
    const char* ending;
    const char* name;
};

/// The formats that the library writes.
inline constexpr std::array<ExportFormat, 6> kExportFormats{{
    {".stl", "STL, for printing"},
    {".3mf", "3MF, for printing, with name and colour"},
    {".ply", "PLY, with normals"},
    {".obj", "OBJ, as text"},
    {".vtp", "VTP, for ParaView and 3D Slicer"},
    {".glb", "GLB, for the web, with name and colour"},
}};

/// About how large the file will be; nothing for formats that are compressed.
std::optional<double> estimated_bytes(const std::string& ending, std::size_t points, std::size_t triangles);
/// "12.3 MB"
QString size_text(double bytes);

/// The surface as the command line writes it: its name there, and the colour of a preset.
MeshObject export_object(const Scan& scan, const Parameters& parameters, const SurfaceParameters& surface,
                         const Mesh& mesh);

/// The arguments after `marrow` that write this surface to `output`.
std::vector<std::string> command_arguments(const Scan& scan, const Parameters& parameters,
                                           const SurfaceParameters& surface,
                                           const std::filesystem::path& output, Space space);
/// `marrow` and arguments as a shell takes them.
QString shell_line(const std::vector<std::string>& arguments);

/// A file name for a surface: its name, without what shells and file systems take for something else.
QString file_name(const SurfaceParameters& surface, const std::string& ending);

}  // namespace marrow::viewer
