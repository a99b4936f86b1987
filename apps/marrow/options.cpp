// Declares the options that several commands share.
#include "options.h"

#include <limits>

#include "console.h"

namespace marrow::cli {
namespace fs = std::filesystem;

const char* const kScanHelp =
    "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; folder of slice images";

const char* const kExitCodesHelp =
    "Exit codes: 0 success, 2 usage error, 3 file not readable or not writable, 4 ambiguous or refused\n"
    "geometry, 5 empty surface, 6 failed check, 130 cancelled.\n"
    "For research use only; not a medical device.";

void add_scan_input(Arguments& arguments, ScanInput& input) {
    arguments.add_input("INPUT", input.path, kScanHelp);
}

void require_input(const fs::path& input) {
    if (input.empty()) throw UsageError("no scan is given: name a file or folder (see marrow --help)");
}

void require_output(const fs::path& mesh, const fs::path& picture) {
    if (mesh.empty() && picture.empty())
        throw UsageError(
            "no output is given: add -o OUT.stl (or .ply, .obj, .vtp, .3mf, .glb), --picture FILE.png, or "
            "both");
}

void add_scan_options(Arguments& arguments, ScanOptions& options) {
    arguments.add_option("--series", text_value("UID", options.series),
                         "Read this DICOM series; 'marrow info' lists them.");
    arguments.add_option("--spacing", spacing_value(options.spacing),
                         "Set the distance between samples in mm, for images that do not state it.");
    arguments.add_flag("--resample", options.resample,
                       "Interpolate unevenly spaced DICOM slices linearly to even spacing.");
    arguments.add_option("--volume",
                         integer_value("K", options.volume, std::numeric_limits<std::int64_t>::min()),
                         "Read volume K of a 4D NIfTI or MetaImage file, counted from 0.");
}

void add_threads_option(Arguments& arguments, int& threads) {
    arguments.add_option("--threads", integer_value("N", threads, 0, std::numeric_limits<int>::max()),
                         "Use N threads; 0 (default) uses all.");
}

void add_mesh_option(Arguments& arguments, fs::path& mesh) {
    arguments.add_option("-o,--output", file_value("OUT", mesh),
                         "Write the mesh to OUT: .stl, .ply, .obj (also .gz), .vtp, .3mf or .glb.");
}

void add_picture_option(Arguments& arguments, fs::path& picture) {
    arguments.add_option("--picture", file_value("FILE.png", picture, ".png"),
                         "Write a picture of the surface.");
}

void add_space_option(Arguments& arguments, Space& space) {
    const auto store = [&space](const std::string& text) {
        space = text == "RAS" ? Space::RAS : Space::LPS;
        return text == "RAS" || text == "LPS";
    };
    arguments.add_option("--space", {"SPACE", "LPS or RAS", store},
                         "Write coordinates in LPS (default) or RAS axes.");
}

void add_json_option(Arguments& arguments, Reporting& reporting) {
    arguments.add_flag("--json", reporting.json, "Print the results as one JSON object.");
}

void add_quiet_option(Arguments& arguments, Reporting& reporting) {
    arguments.add_flag("-q,--quiet", reporting.quiet, "Print only errors, and JSON if requested.");
}

void add_verbose_option(Arguments& arguments, Reporting& reporting) {
    arguments.add_flag("-v,--verbose", reporting.verbose, "Print how long each stage took.");
}

}  // namespace marrow::cli
