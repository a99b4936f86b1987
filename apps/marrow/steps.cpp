#include "steps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/measure.h>

#include "report_progress.h"
#include "usage_error.h"

namespace marrow {
namespace {

std::array<std::int64_t, 3> whole(const Vec3d& v) {
    return {static_cast<std::int64_t>(v[0]), static_cast<std::int64_t>(v[1]),
            static_cast<std::int64_t>(v[2])};
}

// Of the samples, LPS mm.
Box bounds(const Geometry& geometry) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    for (unsigned corner = 0; corner < 8; ++corner) {
        Vec3d index;
        for (std::size_t a = 0; a < 3; ++a)
            index[a] = (corner >> a & 1) != 0 ? static_cast<double>(geometry.dims[a] - 1) : 0;
        const Vec3d at = geometry.physical(index);
        for (std::size_t a = 0; a < 3; ++a) {
            box.lower[a] = std::min(box.lower[a], at[a]);
            box.upper[a] = std::max(box.upper[a], at[a]);
        }
    }
    return box;
}

// Where the box is not in the scan, the command line does not fit it.
Volume cropped(const Volume& scan, const Steps& steps) {
    try {
        return steps.crop_in_samples ? crop(scan, whole(steps.crop->lower), whole(steps.crop->upper))
                                     : crop(scan, *steps.crop);
    } catch (const InputError&) {
        const Geometry& geometry = scan.geometry();
        const auto& dims = geometry.dims;
        if (steps.crop_in_samples)
            throw UsageError(
                fmt::format("--crop: the box leaves the scan, whose samples are vox:0,{},0,{},0,{}",
                            dims[0] - 1, dims[1] - 1, dims[2] - 1));
        Box box = bounds(geometry);
        if (steps.crop_in_ras)
            box = {{-box.upper[0], -box.upper[1], box.lower[2]},
                   {-box.lower[0], -box.lower[1], box.upper[2]}};
        throw UsageError(fmt::format(
            "--crop: no sample of the scan lies in the box; it goes from {:g} to {:g}, {:g} to {:g} "
            "and {:g} to {:g} mm in {}",
            box.lower[0], box.upper[0], box.lower[1], box.upper[1], box.lower[2], box.upper[2],
            steps.crop_in_ras ? "RAS" : "LPS"));
    }
}

Mesh smoothed(const Mesh& mesh, const Steps& steps, const Mat3d& index_to_physical, int threads,
              const Progress& progress, std::string& note) {
    SmoothOptions options{.iterations = steps.smooth, .threads = threads, .progress = progress};
    if (steps.smooth_bound) options.bound = index_to_physical;
    SmoothStats stats;
    Mesh result = smooth(mesh, options, &stats);
    if (stats.restored_components > 0)
        note = fmt::format("{} pieces too small to smooth keep their shape", stats.restored_components);
    return result;
}

Mesh reduced(const Mesh& mesh, const Steps& steps, int threads, const Progress& progress,
             StepReport& report) {
    SimplifyOptions options{
        .triangles = steps.triangles, .max_error = steps.max_error, .threads = threads, .progress = progress};
    if (steps.keep)
        options.triangles = std::llround(*steps.keep * static_cast<double>(mesh.triangles.size()));
    SimplifyStats stats;
    Mesh result = simplify(mesh, options, &stats);
    report.deviation = stats.deviation;
    if (stats.backed_off)
        report.note = "left as it was: no reduction keeps the error and the topology";
    else if (!steps.max_error && static_cast<std::int64_t>(result.triangles.size()) > *options.triangles)
        report.note =
            fmt::format("{} triangles were asked for, but no more can go without harm to the surface",
                        *options.triangles);
    return result;
}

}  // namespace

void filter_scan(Volume& scan, const Steps& steps, int threads, const Progress& progress) {
    const FilterOptions options{threads, progress};
    if (steps.crop) scan = cropped(scan, steps);
    if (steps.median > 0) scan = median_filter(scan, steps.median, options);
    if (steps.blur > 0) scan = gaussian_filter(scan, steps.blur, options);
    if (steps.isotropic > 0) scan = resample_isotropic(scan, steps.isotropic, options);
}

std::vector<StepReport> refine_surface(Mesh& mesh, const Steps& steps, const Mat3d& index_to_physical,
                                       int threads, const Progress& progress) {
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
            options.threads = threads;
            if (steps.largest) options.count = 1, options.cavities = false;
            return keep_components(mesh, options);
        });
    if (steps.smooth > 0)
        step("smooth", [&](StepReport& done) {
            return smoothed(mesh, steps, index_to_physical, threads, progress, done.note);
        });
    if (steps.reduce())
        step("reduce", [&](StepReport& done) { return reduced(mesh, steps, threads, progress, done); });
    return reports;
}

}  // namespace marrow
