// Reads and filters a scan, and delivers the surfaces made of it.
#include "surface_job.h"

#include <algorithm>

#include <marrow/measure.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>
#include <marrow/scan_io.h>

#include "outputs.h"
#include "render.h"
#include "report.h"
#include "shared/display.h"
#include "shared/output_checks.h"
#include "shared/report_progress.h"

namespace marrow::apps {
namespace fs = std::filesystem;

SurfaceJob::SurfaceJob(const SurfaceJobOptions& options, const Console& console,
                       const std::atomic<bool>& stop)
    : options_(options), reporter_(options.reporting, console, stop) {}

void SurfaceJob::check_outputs(const std::vector<fs::path>& files) const {
    for (const fs::path& file : files) check_output(file, options_.scan.path);
    check_output(options_.output.picture, options_.scan.path);
    if (!options_.output.picture.empty()) require_display("--picture");
}

bool SurfaceJob::shows_normals(const std::vector<fs::path>& files) const {
    return !options_.output.picture.empty() ||
           std::any_of(files.begin(), files.end(), [](const fs::path& file) {
               return !file.empty() && holds_normals(mesh_format(file));
           });
}

Volume SurfaceJob::read_scan(const FilterSteps& steps, const Inspect& unfiltered,
                             const Inspect& before_mixing) {
    return read(options_.scan.options, steps, unfiltered, before_mixing);
}

Volume SurfaceJob::read_volume(std::int64_t volume, const FilterSteps& steps) {
    ScanOptions options = options_.scan.options;
    options.volume = volume;
    return read(options, steps, {}, {});
}

Volume SurfaceJob::read(ScanOptions options, const FilterSteps& steps, const Inspect& unfiltered,
                        const Inspect& before_mixing) {
    Volume scan;
    results.seconds.read += stage("read", [&](const Progress& progress) {
        options.progress = progress;
        scan = marrow::read_scan(options_.scan.path, options, &results.info);
    });
    check_is_no_slice(options_.output.picture, options_.scan.path, results.info.format);
    results.warnings = results.info.warnings;
    if (unfiltered) unfiltered(scan);
    if (steps.any())
        results.seconds.filter += stage("filter", [&](const Progress& progress) {
            filter_scan(scan, steps, threads(), progress, before_mixing);
        });
    else if (before_mixing)
        before_mixing(scan);
    return scan;
}

double SurfaceJob::stage(const char* name, const std::function<void(const Progress&)>& work) const {
    return reporter_.stage(name, work);
}

void SurfaceJob::print_warnings() {
    for (; printed_warnings_ < results.warnings.size(); ++printed_warnings_)
        reporter_.warn(results.warnings[printed_warnings_]);
}

void SurfaceJob::deliver() {
    print_warnings();
    const MeshOutput& output = options_.output;
    std::vector<fs::path> files;
    for (const Surface& surface : results.surfaces) files.push_back(surface.output);
    check_not_read(files, results.info.series.dicom_files);
    StageSeconds& seconds = results.seconds;
    seconds.write = stage("write", [&](const Progress& progress) {
        write_surfaces(results.surfaces, {.space = output.space,
                                          .progress = progress,
                                          .scan_files = results.info.series.dicom_files,
                                          .keep_patient = output.keep_patient});
    });
    if (output.verify)
        seconds.verify = stage("verify", [&](const Progress& progress) {
            verify_surfaces(results.surfaces, output.space, progress);
            results.verified = 0;
            for (const Surface& surface : results.surfaces) *results.verified += surface.size().triangles;
        });
    if (!output.picture.empty())
        seconds.write += stage("picture", [&](const Progress& progress) { draw(progress); });
    seconds.total = seconds_since(start_);
    if (options_.reporting.json)
        stage("measure", [&](const Progress& progress) {
            for (Surface& surface : results.surfaces) {
                report(progress, 0);
                if (!surface.measures) surface.measures = measure(surface.mesh, {.threads = threads()});
            }
        });
    print_results(reporter_, results, output.space);
}

// The surface of the highest isovalue is the innermost. The others are translucent, so that it is visible.
void SurfaceJob::draw(const Progress& progress) {
    constexpr std::array<double, 3> kNeutral{0.80, 0.81, 0.80};
    double innermost = results.surfaces.front().isovalue;
    for (const Surface& surface : results.surfaces) innermost = std::max(innermost, surface.isovalue);
    std::vector<RenderedSurface> rendered;
    for (Surface& surface : results.surfaces) {
        turn_normals_outward(surface.mesh, threads());
        rendered.push_back(
            {&surface.mesh, surface.colour.value_or(kNeutral), surface.isovalue < innermost,
             surface.trust ? std::span<const Rgb8>(surface.trust->colours) : std::span<const Rgb8>()});
    }
    render(rendered, options_.output.picture, progress);
}

}  // namespace marrow::apps
