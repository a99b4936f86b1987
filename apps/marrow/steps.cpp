#include "steps.h"

#include <cmath>

#include <fmt/format.h>

#include <marrow/measure.h>

namespace marrow {
namespace {

std::array<std::int64_t, 3> whole(const Vec3d& v) {
    return {static_cast<std::int64_t>(v[0]), static_cast<std::int64_t>(v[1]),
            static_cast<std::int64_t>(v[2])};
}

Mesh smoothed(const Mesh& mesh, const Steps& steps, const Mat3d& index_to_physical, const Progress& progress,
              std::string& note) {
    SmoothOptions options{.iterations = steps.smooth, .progress = progress};
    if (steps.smooth_bound) options.bound = index_to_physical;
    SmoothStats stats;
    Mesh result = smooth(mesh, options, &stats);
    if (stats.restored_shells > 0)
        note = fmt::format("{} pieces too small to smooth keep their shape", stats.restored_shells);
    return result;
}

Mesh reduced(const Mesh& mesh, const Steps& steps, const Progress& progress, StepReport& report) {
    SimplifyOptions options{.progress = progress};
    if (steps.triangles) options.triangles = *steps.triangles;
    if (steps.keep)
        options.triangles = std::llround(*steps.keep * static_cast<double>(mesh.triangles.size()));
    if (steps.max_error) options.max_error = *steps.max_error;
    SimplifyStats stats;
    Mesh result = simplify(mesh, options, &stats);
    report.deviation = stats.deviation;
    if (stats.backed_off)
        report.note = "left as it was: no reduction keeps the error and the topology";
    else if (!steps.max_error && static_cast<std::int64_t>(result.triangles.size()) > options.triangles)
        report.note = fmt::format(
            "{} triangles were asked for, but no more can go without harm to the surface", options.triangles);
    return result;
}

}  // namespace

void filter_scan(Volume& scan, const Steps& steps, int threads, const Progress& progress) {
    const FilterOptions options{threads, progress};
    if (steps.crop)
        scan = steps.crop_in_samples ? crop(scan, whole(steps.crop->lower), whole(steps.crop->upper))
                                     : crop(scan, *steps.crop);
    if (steps.median > 0) scan = median_filter(scan, steps.median, options);
    if (steps.blur > 0) scan = gaussian_filter(scan, steps.blur, options);
    if (steps.isotropic > 0) scan = resample_isotropic(scan, steps.isotropic, options);
}

std::vector<StepReport> refine_surface(Mesh& mesh, const Steps& steps, const Mat3d& index_to_physical,
                                       const Progress& progress) {
    std::vector<StepReport> reports;
    const auto step = [&](const char* name, auto change) {
        report(progress, 0);
        const MeshMeasures before = reports.empty() ? measure(mesh) : reports.back().after;
        StepReport done{name, before, {}, {}, {}};
        mesh = change(done);
        done.after = measure(mesh);
        reports.push_back(std::move(done));
    };
    if (steps.choose_pieces())
        step("components", [&](StepReport&) {
            ComponentOptions options = steps.components;
            if (steps.largest) options.count = 1, options.cavities = false;
            return keep_components(mesh, options);
        });
    if (steps.smooth > 0)
        step("smooth",
             [&](StepReport& done) { return smoothed(mesh, steps, index_to_physical, progress, done.note); });
    if (steps.reduce())
        step("reduce", [&](StepReport& done) { return reduced(mesh, steps, progress, done); });
    return reports;
}

}  // namespace marrow
