#include "scan.h"

#include <marrow/tissue_presets.h>

#include "samples.h"

namespace marrow::viewer {

std::shared_ptr<const Scan> open_scan(const std::filesystem::path& input, const ScanOptions& options) {
    auto scan = std::make_shared<Scan>();
    scan->input = input;
    scan->volume = read_scan(input, options, &scan->info);
    scan->options = options;
    scan->options.progress = {};
    scan->histogram = histogram(scan->volume);
    try {
        scan->otsu = otsu_isovalue(scan->histogram);
    } catch (const InputError&) {
        // All samples are alike: there is nothing to part.
    }
    scan->hounsfield = !scan->histogram.counts.empty() &&
                       presets_apply(scan->info.series.modality, scan->info.format, scan->histogram.lower);
    return scan;
}

double sample_at(const Volume& volume, std::int64_t i, std::int64_t j, std::int64_t k) {
    const auto& dims = volume.geometry().dims;
    return with_samples(volume, [&](const auto* samples) {
        return static_cast<double>(samples[(k * dims[1] + j) * dims[0] + i]);
    });
}

Vec3d index_of(const Geometry& geometry, const Vec3d& position) {
    const Mat3d m = geometry.index_to_physical();
    Vec3d d = position;
    for (std::size_t a = 0; a < 3; ++a) d[a] -= geometry.origin[a];
    const auto determinant = [](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    };
    // Cramer's rule over the columns.
    const std::array<Vec3d, 3> columns{Vec3d{m[0][0], m[1][0], m[2][0]}, Vec3d{m[0][1], m[1][1], m[2][1]},
                                       Vec3d{m[0][2], m[1][2], m[2][2]}};
    const double whole = determinant(columns[0], columns[1], columns[2]);
    return {determinant(d, columns[1], columns[2]) / whole, determinant(columns[0], d, columns[2]) / whole,
            determinant(columns[0], columns[1], d) / whole};
}

}  // namespace marrow::viewer
