/// Writing meshes.
#pragma once

#include <filesystem>

#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

/// The patient space of written coordinates: x to the Left, y to Posterior, z to Superior; or Right,
/// Anterior, Superior.
enum class Space { LPS, RAS };

struct MeshWriteOptions {
    Space space = Space::LPS;
    Progress progress = {};
};

/// Writes a mesh; the ending picks the format. The file appears whole or not at all, and an old one stays
/// until then.
///
/// | ending | format           | normals | says its space by     |
/// | ------ | ---------------- | ------- | --------------------- |
/// | .stl   | binary STL       | facet   | `SPACE=LPS` in header |
/// | .ply   | binary PLY       | point   | comment               |
/// | .obj   | text OBJ         | point   | comment               |
/// | .vtp   | VTK XML PolyData | point   | field data            |
///
/// \throw InputError an unknown ending; IoError the system said no; Cancelled.
void write_mesh(const Mesh& mesh, const std::filesystem::path& output, const MeshWriteOptions& options = {});

}  // namespace marrow
