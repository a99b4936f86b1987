// Opens scans and looks up their samples.
#include "scan.h"

#include <marrow/error.h>
#include <marrow/tissue_presets.h>

#include "shared/label_map.h"

namespace marrow::viewer {

std::filesystem::path absolute_path(const std::filesystem::path& path) {
    const std::filesystem::path absolute = std::filesystem::absolute(path);
    std::error_code error;
    const std::filesystem::path folder = std::filesystem::weakly_canonical(absolute.parent_path(), error);
    if (error) return absolute;
    const std::filesystem::path whole = (folder / absolute.filename()).lexically_normal();
    return whole.has_filename() ? whole : whole.parent_path();
}

std::shared_ptr<const Scan> open_scan(const std::filesystem::path& input, const ScanOptions& options) {
    auto scan = std::make_shared<Scan>();
    scan->input = absolute_path(input);
    scan->options = options;
    scan->options.keep_stored = true;
    scan->volume = read_scan(input, scan->options, &scan->info);
    scan->options.progress = {};
    scan->histogram = histogram(scan->volume, 256, scan->info.padding);
    try {
        scan->otsu = otsu_isovalue(scan->histogram);
    } catch (const InputError&) {
        // All samples are equal: no isovalue separates them.
    }
    scan->hounsfield = !scan->histogram.counts.empty() &&
                       presets_apply(scan->info.series.modality, scan->info.format, scan->histogram.lower);
    if (apps::is_label_map(scan->volume, scan->info.series))
        scan->info.warnings.push_back(
            "the samples look like labels: an isosurface encloses all labels above the isovalue, and on the "
            "command line --labels makes a surface of each");
    return scan;
}

double sample_at(const Volume& volume, std::int64_t i, std::int64_t j, std::int64_t k) {
    const auto& dims = volume.geometry().dims;
    return volume.rescale().value(visit_sample_type(volume.type(), [&](auto type) {
        return static_cast<double>(volume.samples<decltype(type)>()[(k * dims[1] + j) * dims[0] + i]);
    }));
}

Vec3d index_of(const Geometry& geometry, const Vec3d& position) {
    return inverse(geometry.index_to_physical()) * (position - geometry.origin);
}

}  // namespace marrow::viewer
