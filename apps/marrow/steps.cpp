// Declares and does the steps before and after extraction.
#include "steps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <marrow/components.h>
#include <marrow/measure.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>

#include "shared/console.h"
#include "shared/report_progress.h"
#include "shared/surface_warnings.h"

namespace marrow::apps {
namespace {

// X0,X1,Y0,Y1,Z0,Z1 in mm, or in samples after "vox:".
bool store_crop(std::string_view text, std::optional<CropBox>& crop) {
    constexpr std::string_view kSamples = "vox:";
    const bool in_samples = text.starts_with(kSamples);
    double e[6];
    if (!parse_numbers(in_samples ? text.substr(kSamples.size()) : text, e, 6)) return false;
    if (e[0] > e[1] || e[2] > e[3] || e[4] > e[5]) return false;
    const auto is_index = [](double end) { return end == std::floor(end) && std::abs(end) <= 1e9; };
    if (in_samples && !std::all_of(e, e + 6, is_index)) return false;
    crop = CropBox{{{e[0], e[2], e[4]}, {e[1], e[3], e[5]}}, in_samples};
    return true;
}

// Stores a distance in mm, or 0 if there is no text.
Value bound_value(std::optional<double>& to) {
    Value value{"[DISTANCE]", "a distance above 0 in mm, such as 0.5mm", [&to](const std::string& text) {
                    const std::string_view number =
                        text.ends_with("mm") ? std::string_view(text).substr(0, text.size() - 2) : text;
                    to = text.empty() ? 0.0 : parse_number(number);
                    return text.empty() || (to && *to > 0);
                }};
    value.may_be_left = true;
    return value;
}

// LPS to RAS, or back.
Box with_x_and_y_negated(const Box& box) {
    return {{-box.upper[0], -box.upper[1], box.lower[2]}, {-box.lower[0], -box.lower[1], box.upper[2]}};
}

std::array<std::int64_t, 3> to_indices(const Vec3d& v) {
    return {static_cast<std::int64_t>(v[0]), static_cast<std::int64_t>(v[1]),
            static_cast<std::int64_t>(v[2])};
}

[[noreturn]] void throw_outside(const Geometry& geometry, const CropBox& crop) {
    const auto& dims = geometry.dims;
    if (crop.in_samples)
        throw UsageError(
            fmt::format("--crop: the box reaches beyond the scan, whose samples are vox:0,{},0,{},0,{}",
                        dims[0] - 1, dims[1] - 1, dims[2] - 1));
    const bool ras = crop.space == Space::RAS;
    const Box box = ras ? with_x_and_y_negated(bounds(geometry)) : bounds(geometry);
    throw UsageError(
        fmt::format("--crop: the box contains no sample of the scan; it goes from {:g} to {:g}, {:g} to {:g} "
                    "and {:g} to {:g} mm in {}",
                    box.lower[0], box.upper[0], box.lower[1], box.upper[1], box.lower[2], box.upper[2],
                    ras ? "RAS" : "LPS"));
}

Volume cropped(const Volume& scan, const CropBox& wanted) {
    try {
        if (wanted.in_samples) return crop(scan, to_indices(wanted.box.lower), to_indices(wanted.box.upper));
        return crop(scan, wanted.space == Space::RAS ? with_x_and_y_negated(wanted.box) : wanted.box);
    } catch (const InputError&) {
        throw_outside(scan.geometry(), wanted);
    }
}

Mesh with_chosen_components(const Mesh& mesh, const SurfaceSteps& steps, int threads) {
    ComponentOptions options{
        .min_volume = steps.min_volume, .cavities = !steps.no_cavities, .threads = threads};
    if (steps.components > 0) options.count = steps.components;
    if (steps.largest) {
        options.count = 1;
        options.cavities = false;
    }
    return keep_components(mesh, options);
}

Mesh smoothed(const Mesh& mesh, const SurfaceSteps& steps, const Mat3d& index_to_physical, int threads,
              const Progress& progress, StepReport& report) {
    SmoothOptions options{.iterations = steps.smooth, .threads = threads, .progress = progress};
    if (steps.smooth_bound == 0)
        options.bound = index_to_physical;
    else
        options.max_move = steps.smooth_bound;
    SmoothStats stats;
    Mesh result = smooth(mesh, options, &stats);
    report.moved = MeshDistance{stats.moved_mean, stats.moved_max};
    report.held_back = stats.held_back_points;
    report.note = unsmoothed_components_warning(stats.restored_components).value_or("");
    return result;
}

// The largest distance between neighbouring samples, mm.
double coarsest_spacing(const Mat3d& index_to_physical) {
    double coarsest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        coarsest = std::max(coarsest, std::hypot(index_to_physical[0][axis], index_to_physical[1][axis],
                                                 index_to_physical[2][axis]));
    return coarsest;
}

Mesh reduced(const Mesh& mesh, const SurfaceSteps& steps, const Mat3d& index_to_physical, int threads,
             const Progress& progress, StepReport& report) {
    std::optional<std::int64_t> triangles = steps.triangles;
    if (steps.keep) triangles = std::llround(*steps.keep * static_cast<double>(mesh.triangles.size()));
    const SimplifyOptions options{
        .triangles = triangles, .max_error = steps.max_error, .threads = threads, .progress = progress};
    SimplifyStats stats;
    Mesh result = simplify(mesh, options, &stats);
    report.deviation = stats.deviation;
    report.held_back = stats.undone_collapses;
    if (!steps.max_error && triangles)
        report.note =
            unfinished_reduction_warning(*triangles, static_cast<std::int64_t>(result.triangles.size()))
                .value_or("");
    const double sample = coarsest_spacing(index_to_physical);
    if (stats.deviation.max > sample && !steps.max_error)
        report.note += fmt::format(
            "{}the surface moved by up to {:.3g} mm, more than the {:.3g} mm between "
            "samples: --max-error MM keeps it closer",
            report.note.empty() ? "" : "; ", stats.deviation.max, sample);
    return result;
}

void add_crop_option(Arguments& arguments, std::optional<CropBox>& crop, const std::string& axes) {
    arguments.add_option(
        "--crop",
        {"X0,X1,Y0,Y1,Z0,Z1",
         "X0,X1,Y0,Y1,Z0,Z1 in mm, or vox: and six whole numbers in samples, each X0 <= X1",
         [&crop](const std::string& text) { return store_crop(text, crop); }},
        "Keep only the scan within a box, in mm along " + axes +
            "; or in samples, with vox:X0,X1,Y0,Y1,Z0,Z1. Both ends are included. An oblique scan keeps the "
            "block of samples around the box.");
}

}  // namespace

void add_filter_options(Arguments& arguments, FilterSteps& steps, const std::string& axes) {
    add_crop_option(arguments, steps.crop, axes);
    arguments.add_option("--median", integer_value("N", steps.median, 0, 16),
                         "Remove noise: replace each sample by the median of its neighbours up to N samples "
                         "away, 1 to 16; 0: none.");
    arguments.add_option(
        "--blur",
        number_value("MM", "a standard deviation in mm", steps.blur, [](double x) { return x >= 0; }),
        "Blur the scan with a Gaussian of standard deviation MM; 0: none.");
    arguments.add_option(
        "--isotropic",
        number_value("MM", "a spacing in mm", steps.isotropic, [](double x) { return x >= 0; }),
        "Resample the scan to the spacing MM along all axes, which helps with thick slices; 0: none.");
}

void add_surface_options(Arguments& arguments, SurfaceSteps& steps) {
    arguments.add_flag("--largest", steps.largest,
                       "Keep only the largest component; the same as --components 1 --no-cavities.");
    arguments.add_option("--components", integer_value("N", steps.components, 1),
                         "Keep the N components with the most triangles.");
    arguments.add_option(
        "--clean-small",
        number_value("MM3", "a volume in mm3", steps.min_volume, [](double x) { return x >= 0; }),
        "Remove components and fill cavities that enclose less than MM3.");
    arguments.add_flag("--no-cavities", steps.no_cavities, "Fill all cavities: remove the shells inside.");
    arguments.add_option("--smooth", integer_value("N", steps.smooth, 0, 1000),
                         "Smooth the surface with N iterations of a windowed sinc filter, which shrinks only "
                         "thin parts; 20 is usual.");
    arguments.add_option(
        "--smooth-bound", bound_value(steps.smooth_bound),
        "With --smooth: move no point further than DISTANCE, such as 0.5mm; without a DISTANCE, no further "
        "than half a sample along each axis of the scan.");
    arguments.add_option("--keep",
                         number_value("FRACTION", "a fraction above 0, at most 1, such as 0.5 for half",
                                      steps.keep, [](double x) { return x > 0 && x <= 1; }),
                         "Reduce the surface to this fraction of its triangles.");
    arguments.add_option("--triangles", integer_value("N", steps.triangles, 1),
                         "Reduce the surface to at most N triangles.");
    arguments.add_option(
        "--max-error",
        number_value("MM", "a distance above 0 in mm", steps.max_error, [](double x) { return x > 0; }),
        "Reduce the surface as far as it stays within MM of the original, as measured.");
}

void check_steps(const SurfaceSteps& steps) {
    if (steps.smooth_bound && steps.smooth == 0) throw UsageError("--smooth-bound needs --smooth N");
    if (steps.largest && steps.components > 0)
        throw UsageError("--largest and --components both say how many components to keep: give one of them");
    if (steps.keep && steps.triangles)
        throw UsageError("--keep and --triangles both set the number of triangles: give one of them");
}

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

void filter_scan(Volume& scan, const FilterSteps& steps, int threads, const Progress& progress,
                 const Inspect& before_mixing) {
    const FilterOptions options{threads, progress};
    if (steps.crop) scan = cropped(scan, *steps.crop);
    if (steps.median > 0) scan = median_filter(scan, steps.median, options);
    if (before_mixing) before_mixing(scan);
    if (steps.blur > 0) scan = gaussian_filter(scan, steps.blur, options);
    if (steps.isotropic > 0) scan = resample_isotropic(scan, steps.isotropic, options);
}

std::vector<StepReport> refine_surface(Mesh& mesh, const SurfaceSteps& steps, const Mat3d& index_to_physical,
                                       bool all_measures, int threads, const Progress& progress) {
    std::vector<StepReport> reports;
    const auto measured = [&](const Mesh& m) {
        const MeasureOptions options{.threads = threads};
        StepSurface surface{static_cast<std::int64_t>(m.triangles.size()), {}, {}};
        if (all_measures) {
            surface.measures = measure(m, options);
            surface.size = {surface.measures->area, surface.measures->volume};
        } else {
            surface.size = area_and_volume(m, options);
        }
        return surface;
    };
    // Smoothing and reduction take nearly all of the time.
    const double smoothed_at = steps.smooth == 0 ? 0 : steps.reduce() ? 0.5 : 1;
    const auto step = [&](const char* name, double begin, auto change) {
        report(progress, begin);
        const StepSurface before = reports.empty() ? measured(mesh) : reports.back().after;
        StepReport done;
        done.name = name;
        done.before = before;
        mesh = change(done);
        done.after = measured(mesh);
        reports.push_back(std::move(done));
    };
    if (steps.choose_components())
        step("components", 0, [&](StepReport&) { return with_chosen_components(mesh, steps, threads); });
    if (steps.smooth > 0)
        step("smooth", 0, [&](StepReport& done) {
            return smoothed(mesh, steps, index_to_physical, threads, share_of(progress, 0, smoothed_at),
                            done);
        });
    if (steps.reduce())
        step("reduce", smoothed_at, [&](StepReport& done) {
            return reduced(mesh, steps, index_to_physical, threads, share_of(progress, smoothed_at, 1), done);
        });
    return reports;
}

}  // namespace marrow::apps
