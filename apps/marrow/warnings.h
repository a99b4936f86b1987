/// Warnings about surfaces that are probably not what the user wants.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <marrow/mesh_io.h>
#include <marrow/volume.h>

#include "results.h"

namespace marrow::apps {

/// Warns of samples that are NaN or infinite.
void warn_of_non_finite(std::int64_t samples, std::vector<std::string>& warnings);

/// Warns of surfaces in STL files that have several points with the same coordinates. STL has only
/// coordinates, so its readers merge these points, and edges may then have more than two triangles. `remedy`
/// ends the warning.
void warn_of_coinciding_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                               std::vector<std::string>& warnings);

/// Warns of coordinates that are so large for the spacing that float32 rounds the surfaces visibly.
void warn_of_rounding(const Geometry& geometry, std::vector<std::string>& warnings);

/// Both for isosurfaces. Their points coincide only where the coordinates of a scan are so large that float32
/// cannot separate them.
void warn_of_large_coordinates(const std::vector<Surface>& surfaces, const Geometry& geometry,
                               std::vector<std::string>& warnings);

/// The same for a surface that is written in slabs, whose points are not compared.
void warn_of_large_coordinates(MeshFormat format, const Geometry& geometry,
                               std::vector<std::string>& warnings);

/// Warns of closed surfaces of a scan that has no sample outside, so that the surface is the border of the
/// scan.
void warn_of_box(const std::vector<Surface>& surfaces, const Volume& scan,
                 std::vector<std::string>& warnings);

}  // namespace marrow::apps
