// Reports how far a surface can be trusted.
#include "trust_steps.h"

#include <fmt/format.h>

#include "shared/console.h"
#include "shared/surface_warnings.h"

namespace marrow::apps {
namespace {

std::string percentile_text(const TrustPercentiles& p) {
    return fmt::format("{:.2g} mm (median), {:.2g} mm (90 %), {:.2g} mm (99 % of the points)", p.median,
                       p.percentile_90, p.percentile_99);
}

// The unit of the samples, if it is known.
const char* unit_of(const SurfaceTrust& trust) {
    return trust.hounsfield ? " HU" : "";
}

std::string noise_text(const SurfaceTrust& trust) {
    const NoiseEstimate& noise = trust.report.noise;
    if (noise.windows == 0) return "  noise:      unknown: the scan has too little even tissue\n";
    std::string text = fmt::format(
        "  noise:      {:.3g}{}, the lower of local deviations in tissue ({:.3g}){}; by the Laplacian "
        "{:.3g}\n",
        noise.sigma, unit_of(trust), noise.local_deviation,
        noise.slices ? fmt::format(" and differences of slices ({:.3g})", *noise.slices) : "",
        noise.laplacian);
    return text + fmt::format("              it moves the surface by {}\n",
                              percentile_text(trust.report.noise_shifts));
}

ThinWallState thin_wall_state(const Surface& surface) {
    if (!surface.thin_walls) return ThinWallState::unknown;
    return surface.thin_walls->restored ? ThinWallState::restored : ThinWallState::found;
}

}  // namespace

void add_trust_options(Arguments& arguments, TrustSteps& steps) {
    arguments.start_group("Trust");
    arguments.add_flag(
        "--trust", steps.report,
        "Say how far the surface moves if the isovalue changes by 100 HU (not in CT: by a tenth of the "
        "contrast) and by noise; for each point in .ply and .vtp, and as colours in .glb and the picture.");
    arguments.add_flag(
        "--keep-thin", steps.keep_thin,
        "Restore walls that are too thin for the scan, at half of their own peak. A fold of soft tissue "
        "in air looks the same.");
    arguments.add_flag("--no-alarm", steps.no_alarm,
                       "With --type bone: do not look for walls that are too thin for the scan.");
}

void check_trust(const TrustSteps& steps) {
    if (steps.keep_thin && steps.no_alarm)
        throw UsageError(
            "--keep-thin restores the walls that --no-alarm does not look for: leave one of them out");
}

void look_for_thin_walls(Surface& surface, const Volume& scan, const NoiseEstimate& noise,
                         std::optional<double> padding, bool keep, IsosurfaceOptions options) {
    // Each half of the progress is one of the two steps.
    const Progress progress = options.progress;
    const auto half = [&](double begin) { return [&, begin](double f) { return progress(begin + f / 2); }; };
    surface.thin_walls = VanishedWalls{
        .found = find_thin_walls(
            scan, surface.isovalue, surface.mesh,
            {.noise = noise.sigma, .padding = padding, .threads = options.threads, .progress = half(0)}),
        .noise_is_known = noise.windows > 0};
    if (!keep || surface.thin_walls->found.samples.empty()) return;
    const Volume restored = restore_thin_walls(scan, surface.isovalue, surface.thin_walls->found,
                                               [&](double) { return progress(0.5); });
    options.progress = half(0.5);
    surface.mesh = extract_isosurface(restored, surface.isovalue, options);
    surface.device = kCpu;
    surface.thin_walls->restored = true;
}

void add_trust(Surface& surface, const Volume& scan, bool hounsfield, TrustOptions options) {
    if (hounsfield) options.step = 100;
    surface.trust =
        surface_trust(report_trust(scan, surface.mesh.points, options), hounsfield, scan, surface.mesh.points,
                      surface.thin_walls ? &surface.thin_walls->found : nullptr);
}

void add_point_data(const Surface& surface, MeshObject& object) {
    if (surface.trust) add_trust(*surface.trust, thin_wall_state(surface), object);
}

std::string trust_lines(const Surface& surface) {
    std::string lines;
    if (surface.thin_walls && surface.thin_walls->restored)
        lines += fmt::format("  thin walls: {} restored\n", thin_walls_text(surface.thin_walls->found));
    if (!surface.trust) return lines;
    const SurfaceTrust& trust = *surface.trust;
    lines += fmt::format("  trust:      {:g}{} more or less move the surface by {}\n", trust.report.step,
                         unit_of(trust), percentile_text(trust.report.shifts));
    if (trust.report.shifts.capped > 0)
        lines += fmt::format("              {} points move by more than the coarsest spacing, {:.3g} mm\n",
                             trust.report.shifts.capped, trust.report.cap);
    return lines + noise_text(trust);
}

std::optional<std::string> thin_wall_warning(const Surface& surface, Space space) {
    if (!surface.thin_walls || surface.thin_walls->restored) return {};
    return thin_walls_warning(surface.thin_walls->found, surface.thin_walls->noise_is_known, surface.isovalue,
                              space);
}

}  // namespace marrow::apps
