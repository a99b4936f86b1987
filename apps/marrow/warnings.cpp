// Applies the warnings of the programs to the results of a command.
#include "warnings.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "shared/surface_warnings.h"

namespace marrow::apps {
namespace {

std::vector<MeshFile> files_of(const std::vector<Surface>& surfaces) {
    std::vector<MeshFile> files;
    for (const Surface& surface : surfaces) files.push_back({surface.mesh, surface.output});
    return files;
}

void add(const std::optional<std::string>& warning, std::vector<std::string>& warnings) {
    if (warning) warnings.push_back(*warning);
}

}  // namespace

void warn_of_coinciding_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                               std::vector<std::string>& warnings) {
    add(coinciding_points_warning(files_of(surfaces), remedy), warnings);
}

void warn_of_non_finite(std::int64_t samples, std::vector<std::string>& warnings) {
    add(non_finite_warning(samples), warnings);
}

void warn_of_rounding(const Geometry& geometry, std::vector<std::string>& warnings) {
    add(rounding_warning(geometry), warnings);
}

void warn_of_large_coordinates(const std::vector<Surface>& surfaces, const Geometry& geometry,
                               std::vector<std::string>& warnings) {
    add(large_coordinates_warning(files_of(surfaces), geometry), warnings);
}

void warn_of_large_coordinates(MeshFormat format, const Geometry& geometry,
                               std::vector<std::string>& warnings) {
    add(large_coordinates_warning(format, geometry), warnings);
}

void warn_of_box(const std::vector<Surface>& surfaces, const Volume& scan,
                 std::vector<std::string>& warnings) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Surface& surface : surfaces) lowest = std::min(lowest, surface.isovalue);
    add(border_warning(lowest, scan), warnings);
}

}  // namespace marrow::apps
