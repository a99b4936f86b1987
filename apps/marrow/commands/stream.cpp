// Extracts an isosurface of a scan that does not fit in memory.
#include "stream.h"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>
#include <marrow/streaming.h>

#include "outputs.h"
#include "report.h"
#include "shared/output_checks.h"
#include "shared/sample_text.h"
#include "shared/values.h"
#include "warnings.h"

namespace marrow::apps {
namespace {

std::filesystem::path file_of(const StreamOptions& options) {
    const MeshOutput& output = options.job.output;
    return surface_files(output.mesh, output.space, {options.surface.name}).front();
}

// What the program takes beside the arrays of the extraction, in bytes: its code and libraries, and the
// buffers and thread stacks to come.
std::size_t program_memory() {
    constexpr std::size_t kBuffers = std::size_t{24} << 20;
    std::size_t pages = 0, resident_pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident_pages;
    return resident_pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + kBuffers;
}

[[noreturn]] void throw_empty(double isovalue, const Geometry& geometry, bool open,
                              std::int64_t non_finite_samples) {
    if (open && *std::min_element(geometry.dims.begin(), geometry.dims.end()) < 2)
        throw EmptySurface("an open surface needs at least 2 samples along each axis: leave --open out");
    if (non_finite_samples == geometry.sample_count())
        throw EmptySurface("the scan has no finite sample, so there is no surface");
    throw EmptySurface(fmt::format("no surface at isovalue {}: all finite samples are on one side of it",
                                   value_text(isovalue)));
}

}  // namespace

void add_options(Arguments& arguments, StreamOptions& options) {
    arguments.add_option(
        "--max-memory", memory_value(options.memory),
        "Read and write slab by slab within this much memory, which includes the program's: "
        "Zarr, uncompressed NRRD, MetaImage or NIfTI to .stl or .ply, with one --isovalue N.");
}

void check(const StreamOptions& options) {
    if (!options.surface.isovalue)
        throw UsageError("--max-memory needs one --isovalue N, as 'otsu' and --type need the complete scan");
    if (options.job.output.mesh.empty()) throw UsageError("--max-memory needs -o OUT.stl or OUT.ply");
    const std::filesystem::path file = file_of(options);
    if (const MeshFormat format = mesh_format(file);
        (format != MeshFormat::stl && format != MeshFormat::ply) ||
        lower_case(file.extension().string()) == ".gz")
        throw UsageError(fmt::format("--max-memory writes .stl or .ply, not '{}'", file.string()));
}

void run(const StreamOptions& options, const Console& console, const std::atomic<bool>& stop) {
    const Clock::time_point start = Clock::now();
    const ProgressReporter reporter(options.job.reporting, console, stop);
    const ScanInput& scan = options.job.scan;
    const Space space = options.job.output.space;
    Surface surface{options.surface.name, *options.surface.isovalue, {}, file_of(options), {},
                    Surface::Size{}};
    check_output(surface.output, scan.path);

    SurfaceResults results;
    const SliceSource source = open_slices(scan.path, scan.options, &results.info);
    const bool normals = holds_normals(mesh_format(surface.output));
    SurfaceWriter writer(surface.output, {space, {}});
    SurfaceSink sink = writer.sink();
    const auto begin = sink.begin;
    IsosurfaceStats stats;
    sink.begin = [&](std::uint64_t points, std::uint64_t triangles, bool with_normals) {
        if (triangles == 0)
            throw_empty(surface.isovalue, source.geometry, options.open, stats.non_finite_samples);
        surface.in_slabs = {points, triangles};
        begin(points, triangles, with_normals);
    };
    results.seconds.extract = reporter.stage("extract", [&](const Progress& progress) {
        extract_isosurface_in_slabs(source, surface.isovalue, sink,
                                    {.memory = *options.memory, .reserved = program_memory()},
                                    {.normals = normals,
                                     .closed = !options.open,
                                     .topology = options.topology,
                                     .threads = scan.options.threads,
                                     .progress = progress},
                                    &stats);
    });
    results.seconds.write = reporter.stage("write", [&](const Progress&) { writer.commit(); });

    results.surfaces = {surface};
    results.warnings = results.info.warnings;
    warn_of_non_finite(stats.non_finite_samples, results.warnings);
    warn_of_large_coordinates(mesh_format(surface.output), source.geometry, results.warnings);
    for (const std::string& warning : results.warnings) reporter.warn(warning);
    results.seconds.total = seconds_since(start);
    print_results(reporter, results, space);
}

}  // namespace marrow::apps
