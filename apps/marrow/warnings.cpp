// Finds surfaces that are probably not what the user wants.
#include "warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/histogram.h>
#include <marrow/mesh_io.h>
#include <marrow/volume_filters.h>

namespace marrow::cli {
namespace {

std::size_t coinciding_points(const Mesh& mesh) {
    std::vector<Vec3f> points(mesh.points.begin(), mesh.points.end());
    std::sort(points.begin(), points.end());
    std::size_t coinciding = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        coinciding +=
            (i > 0 && points[i] == points[i - 1]) || (i + 1 < points.size() && points[i] == points[i + 1]);
    return coinciding;
}

}  // namespace

void warn_of_coinciding_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                               std::vector<std::string>& warnings) {
    std::size_t points = 0, files = 0;
    for (const Surface& surface : surfaces) {
        if (surface.output.empty() || mesh_format(surface.output) != MeshFormat::stl) continue;
        const std::size_t coinciding = coinciding_points(surface.mesh);
        points += coinciding;
        files += coinciding > 0;
    }
    if (points > 0)
        warnings.push_back(fmt::format(
            "{} points in {} of {} surfaces have the same coordinates as others; STL cannot keep them apart, "
            "so a reader may find edges that more than two triangles share: {}",
            points, files, surfaces.size(), remedy));
}

void warn_of_non_finite(std::int64_t samples, std::vector<std::string>& warnings) {
    if (samples > 0)
        warnings.push_back(fmt::format("{} samples are NaN or infinite and are treated as outside", samples));
}

// Points around a sample are at least a thousandth of an edge apart, which float32 separates unless the
// coordinates are thousands of times larger than the spacing. So few scans need to be searched.
void warn_of_large_coordinates(const std::vector<Surface>& surfaces, const Geometry& geometry,
                               std::vector<std::string>& warnings) {
    double largest = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        Vec3d index{};
        for (std::size_t a = 0; a < 3; ++a)
            index[a] = (corner >> a & 1) != 0 ? static_cast<double>(geometry.dims[a]) : -1.0;
        for (const double coordinate : geometry.physical(index))
            largest = std::max(largest, std::abs(coordinate));
    }
    const double spacing = *std::min_element(geometry.spacing.begin(), geometry.spacing.end());
    if (largest > 1000 * spacing)
        warn_of_coinciding_points(surfaces,
                                  "the coordinates are too large for float32; write .3mf or .ply, or move "
                                  "the scan closer to the origin",
                                  warnings);
}

void warn_of_box(const std::vector<Surface>& surfaces, const Volume& scan,
                 std::vector<std::string>& warnings) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Surface& surface : surfaces) lowest = std::min(lowest, surface.isovalue);
    const auto [nx, ny, nz] = scan.geometry().dims;
    const Volume first_slice = crop(scan, {0, 0, 0}, {nx - 1, ny - 1, 0});
    const Histogram first = histogram(first_slice);
    if (!first.counts.empty() && first.lower < lowest) return;  // the usual case, and quick
    const Histogram samples = histogram(scan);
    if (!samples.counts.empty() && samples.non_finite_samples == 0 && lowest <= samples.lower)
        warnings.push_back(
            fmt::format("no sample is below isovalue {:g} (they range from {:g} to {:g}), so the surface is "
                        "the border of the scan",
                        lowest, samples.lower, samples.upper));
}

}  // namespace marrow::cli
