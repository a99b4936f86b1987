// Opens scans and looks up their samples.
#include "scan.h"

#include <marrow/error.h>
#include <marrow/tissue_presets.h>

namespace marrow::viewer {

std::shared_ptr<const Scan> open_scan(const std::filesystem::path& input, const ScanOptions& options) {
    auto scan = std::make_shared<Scan>();
    scan->input = input;
    scan->volume = read_scan(input, options, &scan->info);
    scan->options = options;
    scan->options.progress = {};
    scan->histogram = histogram(scan->volume, 256, scan->info.padding);
    try {
        scan->otsu = otsu_isovalue(scan->histogram);
    } catch (const InputError&) {
        // All samples are equal: no isovalue separates them.
    }
    scan->hounsfield = !scan->histogram.counts.empty() &&
                       presets_apply(scan->info.series.modality, scan->info.format, scan->histogram.lower);
    return scan;
}

double sample_at(const Volume& volume, std::int64_t i, std::int64_t j, std::int64_t k) {
    const auto& dims = volume.geometry().dims;
    return visit_sample_type(volume.type(), [&](auto type) {
        return static_cast<double>(volume.samples<decltype(type)>()[(k * dims[1] + j) * dims[0] + i]);
    });
}

Vec3d index_of(const Geometry& geometry, const Vec3d& position) {
    return inverse(geometry.index_to_physical()) * (position - geometry.origin);
}

}  // namespace marrow::viewer
