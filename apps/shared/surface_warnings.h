/// Warnings about surfaces that are probably not what the user wants. Each is one line; nothing: all is well.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>
#include <marrow/thin_walls.h>
#include <marrow/volume.h>

namespace marrow::apps {

/// A mesh and the file that it is written to; an empty path if it is not written.
struct MeshFile {
    MeshView mesh;  // borrowed
    std::filesystem::path file;
};

/// Warns of samples that are NaN or infinite.
std::optional<std::string> non_finite_warning(std::int64_t samples);

/// Warns of STL files that have several points with the same coordinates. STL has only coordinates, so its
/// readers merge these points, and edges may then have more than two triangles. `remedy` ends the warning.
std::optional<std::string> coinciding_points_warning(const std::vector<MeshFile>& files,
                                                     const std::string& remedy);

/// Warns of coordinates that are so large for the spacing that float32 rounds the surface visibly.
std::optional<std::string> rounding_warning(const Geometry& geometry);

/// Both for isosurfaces. Their points coincide only where the coordinates of a scan are so large that
/// float32 cannot separate them.
std::optional<std::string> large_coordinates_warning(const std::vector<MeshFile>& files,
                                                     const Geometry& geometry);

/// The same for a surface that is not in memory, whose points are not compared.
std::optional<std::string> large_coordinates_warning(MeshFormat format, const Geometry& geometry);

/// Warns of a closed surface of a scan that has no sample outside, so that the surface is the border of the
/// scan.
std::optional<std::string> border_warning(double isovalue, const Volume& scan);

/// Says that a format does not tell whether the samples are Hounsfield units,
/// and that they are taken for such.
std::string assumed_hounsfield_warning(ScanFormat format, double lowest_sample);

/// Warns of walls that are too thin for the scan, with the place of the largest in `space`. If the noise is
/// unknown, some of them may be noise.
std::optional<std::string> thin_walls_warning(const ThinWalls& found, bool noise_is_known, double isovalue,
                                              Space space);

/// Says that smoothing left this many components as they were.
std::optional<std::string> unsmoothed_components_warning(std::int64_t components);

/// Warns of a reduction that left more `triangles` than were requested.
std::optional<std::string> unfinished_reduction_warning(std::int64_t requested, std::int64_t triangles);

/// The area and number of thin walls: "123 mm2 in 4 places".
std::string thin_walls_text(const ThinWalls& found);

}  // namespace marrow::apps
