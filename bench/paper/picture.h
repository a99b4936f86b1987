/// A picture as in Figure 13.
#pragma once

#include <filesystem>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::paper {

/// Draws a mesh with normals twice beside each other, shaded and with its triangles' edges, to a PNG file.
/// Needs an X display.
void draw_shaded_and_edges(const Mesh& mesh, const Vec3d& view, const std::filesystem::path& file);

}  // namespace marrow::paper
