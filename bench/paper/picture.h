/// Draws images like Figure 13 of Visutsak 2020.
#pragma once

#include <filesystem>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::paper {

/// Draws a mesh with normals twice, shaded and with the edges of its triangles, into a PNG file. Needs an X
/// display.
void draw_shaded_and_edges(const Mesh& mesh, const Vec3d& view, const std::filesystem::path& file);

}  // namespace marrow::paper
