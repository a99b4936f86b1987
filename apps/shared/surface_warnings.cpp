// Finds surfaces that are probably not what the user wants.
#include "surface_warnings.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <marrow/histogram.h>
#include <marrow/mesh_io.h>
#include <marrow/volume_filters.h>

#include "decimal_text.h"
#include "sample_text.h"

namespace marrow::apps {
namespace {

std::size_t coinciding_points(MeshView mesh) {
    std::vector<Vec3f> points(mesh.points.begin(), mesh.points.end());
    std::sort(points.begin(), points.end());
    std::size_t coinciding = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        coinciding +=
            (i > 0 && points[i] == points[i - 1]) || (i + 1 < points.size() && points[i] == points[i + 1]);
    return coinciding;
}

// A .dcm file holds an STL file.
bool is_stl(MeshFormat format) {
    return format == MeshFormat::stl || format == MeshFormat::dicom;
}

// The largest coordinate, divided by the smallest spacing.
double largest_coordinate_in_samples(const Geometry& geometry) {
    double largest = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        Vec3d index{};
        for (std::size_t a = 0; a < 3; ++a)
            index[a] = (corner >> a & 1) != 0 ? static_cast<double>(geometry.dims[a]) : -1.0;
        for (const double coordinate : geometry.physical(index))
            largest = std::max(largest, std::abs(coordinate));
    }
    return largest / *std::min_element(geometry.spacing.begin(), geometry.spacing.end());
}

// Points around a sample are at least a thousandth of an edge apart, which float32 separates unless the
// coordinates are more than 2000 times as large as the spacing: up to 2048, it holds 1/8192, and three
// roundings make a coordinate. So few scans need to be searched.
bool may_join_points(const Geometry& geometry) {
    return largest_coordinate_in_samples(geometry) > 2000;
}

}  // namespace

std::optional<std::string> non_finite_warning(std::int64_t samples) {
    if (samples == 0) return {};
    return fmt::format("{} samples are NaN or infinite and are treated as outside", samples);
}

std::optional<std::string> coinciding_points_warning(const std::vector<MeshFile>& files,
                                                     const std::string& remedy) {
    std::size_t points = 0, affected = 0;
    for (const MeshFile& file : files) {
        if (file.file.empty() || !is_stl(mesh_format(file.file))) continue;
        const std::size_t coinciding = coinciding_points(file.mesh);
        points += coinciding;
        affected += coinciding > 0;
    }
    if (points == 0) return {};
    return fmt::format(
        "{} points{} have the same coordinates as others; STL cannot keep them apart, so a reader may find "
        "edges that more than two triangles share: {}",
        points, files.size() > 1 ? fmt::format(" in {} of {} surfaces", affected, files.size()) : "", remedy);
}

std::optional<std::string> rounding_warning(const Geometry& geometry) {
    constexpr double kMost = 1.0 / 128;  // of the distance between samples
    const double rounding = std::ldexp(largest_coordinate_in_samples(geometry), -24);
    if (rounding <= kMost) return {};
    return fmt::format(
        "the coordinates are so large that float32 rounds them by up to {:.2g} of the distance between "
        "samples: move the scan closer to the origin",
        rounding);
}

std::optional<std::string> large_coordinates_warning(const std::vector<MeshFile>& files,
                                                     const Geometry& geometry) {
    if (const auto warning = rounding_warning(geometry)) return warning;
    if (!may_join_points(geometry)) return {};
    return coinciding_points_warning(files,
                                     "the coordinates are too large for float32; write .3mf or .ply, or move "
                                     "the scan closer to the origin");
}

std::optional<std::string> large_coordinates_warning(MeshFormat format, const Geometry& geometry) {
    if (const auto warning = rounding_warning(geometry)) return warning;
    if (!is_stl(format) || !may_join_points(geometry)) return {};
    return "the coordinates are so large that float32 may not keep neighbouring points apart, and readers of "
           "STL join such points: write .ply, or move the scan closer to the origin";
}

std::optional<std::string> border_warning(double isovalue, const Volume& scan) {
    const auto [nx, ny, nz] = scan.geometry().dims;
    const Volume first_slice = crop(scan, {0, 0, 0}, {nx - 1, ny - 1, 0});
    const Histogram first = histogram(first_slice);
    if (!first.counts.empty() && first.lower < isovalue) return {};  // the usual case, and quick
    const Histogram samples = histogram(scan);
    if (samples.counts.empty() || samples.non_finite_samples > 0 || isovalue > samples.lower) return {};
    return fmt::format(
        "no sample is below isovalue {} (they range from {} to {}), so the surface is the border of "
        "the scan",
        value_text(isovalue), value_text(samples.lower), value_text(samples.upper));
}

std::string assumed_hounsfield_warning(ScanFormat format, double lowest_sample) {
    return fmt::format(
        "{} does not say whether this is CT; the samples are assumed to be Hounsfield units because the "
        "lowest, {}, looks like air",
        scan_format_name(format), value_text(lowest_sample));
}

std::optional<std::string> thin_walls_warning(const ThinWalls& found, bool noise_is_known, double isovalue,
                                              Space space) {
    if (found.walls.empty()) return {};
    const double sign = space == Space::RAS ? -1 : 1;
    const auto& [at, area] = found.walls.front();
    return fmt::format(
        "{} beside the surface are walls that are too thin for the scan and fall below isovalue {}; the "
        "largest has {} mm2 at {}, {}, {} mm: --keep-thin restores them, --no-alarm does not "
        "look for them{}",
        thin_walls_text(found), value_text(isovalue), decimal_text(area, 0), decimal_text(sign * at[0], 1),
        decimal_text(sign * at[1], 1), decimal_text(at[2], 1),
        noise_is_known ? "" : "; the noise of the scan is unknown, so some of it may be noise");
}

std::optional<std::string> unsmoothed_components_warning(std::int64_t components) {
    if (components == 0) return {};
    if (components == 1) return "1 component is too small to smooth and keeps its shape";
    return fmt::format("{} components are too small to smooth and keep their shape", components);
}

std::optional<std::string> unfinished_reduction_warning(std::int64_t requested, std::int64_t triangles) {
    if (triangles <= requested) return {};
    return fmt::format(
        "{} triangles were requested, but the step stopped where the surface would change its topology or "
        "pass through itself",
        requested);
}

std::string thin_walls_text(const ThinWalls& found) {
    return fmt::format("{} mm2 in {} place{}", decimal_text(found.area, 0), found.walls.size(),
                       found.walls.size() == 1 ? "" : "s");
}

}  // namespace marrow::apps
