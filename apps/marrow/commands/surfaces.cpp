// Declares the options of `marrow INPUT` and says which of them go together.
#include "surfaces.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include <marrow/scan_io.h>

#include "outputs.h"
#include "progress_reporter.h"
#include "shared/device_argument.h"

namespace marrow::apps {
namespace {

// What `marrow INPUT` does. A bit each, so that the table below can combine them.
enum Mode : unsigned { kExtract = 1, kStream = 2, kLabels = 4 };

// The modes that an option goes with. Options that are not listed go with all.
struct OptionModes {
    std::string_view option;
    unsigned modes;
};

constexpr std::array kOptionModes{
    OptionModes{"--isovalue", kExtract | kStream},
    OptionModes{"--type", kExtract},
    OptionModes{"--open", kExtract | kStream},
    OptionModes{"--snap", kExtract},
    OptionModes{"--topology", kExtract | kStream},
    OptionModes{"--trust", kExtract},
    OptionModes{"--keep-thin", kExtract},
    OptionModes{"--no-alarm", kExtract},
    OptionModes{"--max-memory", kStream},
    OptionModes{"--labels", kLabels},
    OptionModes{"--relax", kLabels},
    OptionModes{"--only", kLabels},
    OptionModes{"--crop", kExtract | kLabels},
    OptionModes{"--median", kExtract},
    OptionModes{"--blur", kExtract},
    OptionModes{"--isotropic", kExtract},
    OptionModes{"--largest", kExtract},
    OptionModes{"--components", kExtract},
    OptionModes{"--clean-small", kExtract},
    OptionModes{"--no-cavities", kExtract},
    OptionModes{"--smooth", kExtract},
    OptionModes{"--smooth-bound", kExtract},
    OptionModes{"--keep", kExtract},
    OptionModes{"--triangles", kExtract},
    OptionModes{"--max-error", kExtract},
    OptionModes{"--picture", kExtract | kLabels},
    OptionModes{"--verify", kExtract | kLabels},
    OptionModes{"--device", kExtract},
    OptionModes{"--keep-patient", kExtract | kLabels},
};

constexpr unsigned modes_of(std::string_view option) {
    for (const OptionModes& entry : kOptionModes) {
        if (entry.option == option) return entry.modes;
    }
    return kExtract | kStream | kLabels;
}

bool has(const std::vector<std::string>& given, std::string_view option) {
    return std::find(given.begin(), given.end(), option) != given.end();
}

// Whether the surfaces are those of a segmentation, which is a label map without --labels too, unless
// an isovalue is given.
bool is_of_segmentation(const std::vector<std::string>& given, const SurfaceJobOptions& job,
                        const Console& console, const std::atomic<bool>& stop) {
    for (const char* const other : {"--max-memory", "--isovalue", "--type"})
        if (has(given, other)) return false;
    bool found = false;
    ProgressReporter(job.reporting, console, stop).stage("inspect", [&](const Progress& progress) {
        ScanOptions options = job.scan.options;
        options.progress = progress;
        found = is_segmentation(job.scan.path, options);
    });
    return found;
}

Mode mode_of(const std::vector<std::string>& given, bool segmentation) {
    if (has(given, "--labels") || segmentation) return kLabels;
    return has(given, "--max-memory") ? kStream : kExtract;
}

std::string why_not(Mode mode, std::string_view option) {
    if (option == "--device")
        return "--device is for isosurfaces of a scan in memory: leave it out with --labels, a "
               "segmentation or --max-memory";
    switch (mode) {
        case kLabels:
            return fmt::format(
                "{} does not go with --labels or a segmentation: their surfaces are closed and share "
                "faces",
                option);
        case kStream:
            if (option == "--type")
                return "--type does not go with --max-memory: give the isovalue, such as --isovalue 225.5 "
                       "for bone";
            return fmt::format(
                "{} does not go with --max-memory, which never has the complete scan or surface", option);
        case kExtract:
            break;
    }
    return fmt::format("{} goes only with --labels or a segmentation", option);
}

void check_modes(Mode mode, const std::vector<std::string>& given) {
    for (const std::string& option : given) {
        if ((modes_of(option) & mode) == 0) throw UsageError(why_not(mode, option));
    }
}

void check_shared(const SurfacesOptions& options) {
    const SurfaceJobOptions& job = options.job;
    if (job.scan.path.empty() && !options.labels.table.empty())
        throw UsageError(fmt::format(
            "no scan is given, as '{0}' after --labels is its table: if it is the label map, write "
            "'marrow {0} --labels'",
            options.labels.table.string()));
    require_input(job.scan.path, "marrow");
    std::error_code ignored;
    if (!std::filesystem::exists(job.scan.path, ignored))
        throw IoError(fmt::format("'{}': there is no such file or folder, and no such command",
                                  job.scan.path.string()));
    require_output(job.output.mesh, job.output.picture);
    if (job.output.keep_patient && !is_dicom_output(job.output.mesh))
        throw UsageError("--keep-patient is about DICOM files: add -o OUT.dcm");
    if (job.output.verify && job.output.mesh.empty())
        throw UsageError("--verify checks the file that -o OUT writes: add -o");
}

// Each mode receives the shared options, and those that are declared with another mode.
ExtractOptions extract_options(const SurfacesOptions& options) {
    ExtractOptions result = options.extract;
    result.job = options.job;
    if (result.filters.crop) result.filters.crop->space = options.job.output.space;
    return result;
}

StreamOptions stream_options(const SurfacesOptions& options) {
    StreamOptions result = options.stream;
    result.job = options.job;
    result.open = options.extract.open;
    result.topology = options.extract.topology;
    if (options.extract.isovalues.size() > 1)
        throw UsageError("--max-memory extracts one surface at a time: leave all but one --isovalue out");
    if (options.extract.isovalues.size() == 1) result.surface = options.extract.isovalues.front();
    return result;
}

LabelsOptions labels_options(const SurfacesOptions& options, bool segmentation) {
    LabelsOptions result = options.labels;
    result.job = options.job;
    result.segmentation = segmentation;
    result.job.scan.options.keep_stored = false;  // labels are values
    result.crop = options.extract.filters.crop;
    if (result.crop) result.crop->space = options.job.output.space;
    return result;
}

template <class Options>
void check_and_run(const Options& options, const Console& console, const std::atomic<bool>& stop) {
    check(options);
    run(options, console, stop);
}

}  // namespace

void add_options(Arguments& arguments, SurfacesOptions& options) {
    SurfaceJobOptions& job = options.job;
    add_scan_input(arguments, job.scan);
    add_scan_options(arguments, job.scan.options);
    add_options(arguments, options.stream);
    add_surface_options(arguments, options.extract);
    arguments.start_group("Surfaces of a label map");
    add_options(arguments, options.labels);
    add_step_options(arguments, options.extract);
    arguments.start_group("Output");
    add_mesh_option(arguments, job.output.mesh, ".stl, .ply, .obj (also .gz), .vtp, .3mf, .glb or .dcm");
    add_picture_option(arguments, job.output.picture);
    add_space_option(arguments, job.output.space);
    arguments.add_flag("--keep-patient", job.output.keep_patient,
                       "State patient and study of the scan in a .dcm file.");
    arguments.add_flag("--verify", job.output.verify, "Read the written file and compare every triangle.");
    add_device_option(arguments, options.extract.device);
    add_general_options(arguments, job.scan.options.threads, job.reporting);
}

void run(const Arguments& arguments, const SurfacesOptions& options, const Console& console,
         const std::atomic<bool>& stop) {
    check_shared(options);
    const std::vector<std::string> given = arguments.given();
    const bool segmentation = is_of_segmentation(given, options.job, console, stop);
    const Mode mode = mode_of(given, segmentation);
    check_modes(mode, given);
    if (mode == kLabels)
        check_and_run(labels_options(options, segmentation), console, stop);
    else if (mode == kStream)
        check_and_run(stream_options(options), console, stop);
    else
        check_and_run(extract_options(options), console, stop);
}

}  // namespace marrow::apps
