#include "sweep_run.h"

#include <algorithm>
#include <ostream>

#include <fmt/format.h>

#include <marrow/atomic_file.h>
#include <marrow/histogram.h>
#include <marrow/scan_io.h>

#include "warnings.h"

namespace marrow {
namespace fs = std::filesystem;
namespace {

void write_file(const fs::path& file, const std::string& text) {
    AtomicFile out(file);
    out.write(text);
    out.commit();
}

}  // namespace

void sweep(const Settings& settings, const Console& console, Voice& voice) {
    const SweepSettings& wanted = *settings.sweep;
    check_output(settings.output, settings.inputs.front());
    check_output(wanted.plot, settings.inputs.front());
    ScanInfo info;
    Volume scan;
    voice.stage("read", [&](const Progress& progress) {
        ScanOptions options = scan_options(settings);
        options.progress = progress;
        scan = read_scan(settings.inputs.front(), options, &info);
    });
    const Histogram samples = histogram(scan);
    std::vector<std::string> warnings = info.warnings;
    warn_of_non_finite(samples.non_finite_samples, warnings);
    for (const std::string& warning : warnings) voice.warn(warning);
    if (samples.counts.empty()) throw EmptySurface("the scan has no finite sample, so there is no surface");
    const double from = wanted.from.value_or(samples.lower), to = wanted.to.value_or(samples.upper);
    if (!(from < to))
        throw EmptySurface(
            fmt::format("there are no isovalues between {:g} and {:g}; samples range from {:g} to {:g}", from,
                        to, samples.lower, samples.upper));
    std::vector<double> isovalues;
    for (int i = 0; i < wanted.samples; ++i)
        isovalues.push_back(from + (to - from) * i / (wanted.samples - 1));
    std::vector<SweepSample> measured;
    voice.stage("sweep", [&](const Progress& progress) {
        measured = sweep_isovalues(scan, isovalues, {settings.threads, progress});
    });
    if (std::all_of(measured.begin(), measured.end(), [](const SweepSample& s) { return s.triangles == 0; }))
        throw EmptySurface(
            fmt::format("no surface at isovalues from {:g} to {:g}: samples range from {:g} to {:g}", from,
                        to, samples.lower, samples.upper));
    const Vec3d& spacing = scan.geometry().spacing;
    const std::vector<Plateau> plateaus =
        find_plateaus(measured, *std::min_element(spacing.begin(), spacing.end()), otsu_contrast(samples));

    if (!settings.output.empty())
        write_file(settings.output, settings.output.extension() == ".json" ? sweep_json(measured, plateaus)
                                                                           : sweep_csv(measured, plateaus));
    if (!wanted.plot.empty()) write_file(wanted.plot, sweep_svg(measured, plateaus));
    if (settings.json) {
        console.out << sweep_json(measured, plateaus);
    } else if (!settings.quiet && settings.output.empty()) {
        console.out << sweep_csv(measured, plateaus);
    } else if (!settings.quiet) {
        for (const Plateau& p : plateaus)
            console.out << fmt::format("plateau from {:g} to {:g}\n", measured[p.first].isovalue,
                                       measured[p.last].isovalue);
        if (plateaus.empty()) console.out << "no plateau\n";
    }
}

}  // namespace marrow
