#include "warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/volume_filters.h>
#include <marrow/histogram.h>
#include <marrow/mesh_io.h>

namespace marrow {
namespace {

std::size_t meeting_points(const Mesh& mesh) {
    std::vector<Vec3f> points(mesh.points.begin(), mesh.points.end());
    std::sort(points.begin(), points.end());
    std::size_t meeting = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        meeting +=
            (i > 0 && points[i] == points[i - 1]) || (i + 1 < points.size() && points[i] == points[i + 1]);
    return meeting;
}

}  // namespace

void warn_of_meeting_points(const std::vector<Surface>& surfaces, const std::string& remedy,
                            std::vector<std::string>& warnings) {
    std::size_t points = 0, files = 0;
    for (const Surface& surface : surfaces) {
        if (surface.output.empty() || mesh_format(surface.output) != MeshFormat::stl) continue;
        const std::size_t meeting = meeting_points(surface.mesh);
        points += meeting;
        files += meeting > 0;
    }
    if (points > 0)
        warnings.push_back(fmt::format(
            "{} points in {} of {} surfaces lie where others do; STL cannot keep them apart, so a "
            "reader may find edges that more than two triangles share: {}",
            points, files, surfaces.size(), remedy));
}

void warn_of_non_finite(std::int64_t samples, std::vector<std::string>& warnings) {
    if (samples > 0)
        warnings.push_back(fmt::format("{} samples are NaN or infinite and count as outside", samples));
}

// Points meet at samples that are equal to the isovalue, which between integers none is.
void warn_of_ties(const std::vector<Surface>& surfaces, const Volume& scan,
                  std::vector<std::string>& warnings) {
    const bool integers = scan.type() != SampleType::float32 && scan.type() != SampleType::float64;
    const bool between = std::all_of(surfaces.begin(), surfaces.end(), [](const Surface& surface) {
        return surface.isovalue != std::floor(surface.isovalue);
    });
    if (!(integers && between))
        warn_of_meeting_points(
            surfaces,
            "take an isovalue that no sample has, such as N.5 where samples are integers, or --snap 0.3",
            warnings);
}

// Of a scan that is inside as a whole, the surface is what closes it.
void warn_of_box(const std::vector<Surface>& surfaces, const Volume& scan,
                 std::vector<std::string>& warnings) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Surface& surface : surfaces) lowest = std::min(lowest, surface.isovalue);
    const auto [nx, ny, nz] = scan.geometry().dims;
    const Volume first_slice = crop(scan, {0, 0, 0}, {nx - 1, ny - 1, 0});
    const Histogram first = histogram(first_slice);
    if (!first.counts.empty() && first.lower < lowest) return;  // mostly so, and quick
    const Histogram samples = histogram(scan);
    if (!samples.counts.empty() && samples.non_finite_samples == 0 && lowest <= samples.lower)
        warnings.push_back(
            fmt::format("no sample is below isovalue {:g} (they range from {:g} to {:g}), so the surface is "
                        "where the scan ends",
                        lowest, samples.lower, samples.upper));
}

}  // namespace marrow
