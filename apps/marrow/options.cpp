// Declares the options that several commands share.
#include "options.h"

#include <limits>

#include <fmt/format.h>

#include "shared/console.h"

namespace marrow::apps {
namespace fs = std::filesystem;

const char* const kExitCodesHelp =
    "Exit codes: 0 success; 2 the command line is wrong, or does not fit the input; 3 a file cannot be read\n"
    "(missing, damaged, not supported, too large) or written, or there is no display or no such device;\n"
    "4 the scan is ambiguous, or its geometry would distort the result; 5 there is no surface;\n"
    "6 a check failed; 130 cancelled.\n"
    "For research use only; not a medical device.";

void require_input(const fs::path& input, std::string_view command) {
    if (input.empty())
        throw UsageError(fmt::format("no scan is given: name a file or folder (see {} --help)", command));
    if (input == "-") throw UsageError("a scan cannot be read from standard input: name a file or folder");
}

void require_output(const fs::path& mesh, const fs::path& picture) {
    if (mesh.empty() && picture.empty())
        throw UsageError(
            "no output is given: add -o OUT.stl or another mesh file, --picture FILE.png, or both");
}

void add_threads_option(Arguments& arguments, int& threads) {
    arguments.start_group("General");
    arguments.add_option("--threads", integer_value("N", threads, 0, std::numeric_limits<int>::max()),
                         "Use N threads; 0 (default) uses all.");
}

void add_mesh_option(Arguments& arguments, fs::path& mesh, const std::string& formats) {
    arguments.add_option("-o,--output", file_value("OUT", mesh),
                         "Write the mesh to OUT: " + formats +
                             ". A folder gets an .stl file for each surface, named after it; {name} in OUT "
                             "stands for that name.");
}

void add_picture_option(Arguments& arguments, fs::path& picture) {
    arguments.add_option("--picture", file_value("FILE.png", picture, ".png"),
                         "Write a picture of the surface.");
}

void add_space_option(Arguments& arguments, Space& space) {
    const auto store = [&space](const std::string& text) {
        const bool is_ras = text == "RAS" || text == "ras";
        space = is_ras ? Space::RAS : Space::LPS;
        return is_ras || text == "LPS" || text == "lps";
    };
    arguments.add_option("--space", {"SPACE", "LPS or RAS", store},
                         "Write coordinates in LPS (default) or RAS axes.");
}

void add_json_option(Arguments& arguments, Reporting& reporting) {
    arguments.start_group("General");
    arguments.add_flag("--json", reporting.json, "Print the results, or the error, as one JSON object.");
}

void add_quiet_option(Arguments& arguments, Reporting& reporting) {
    arguments.start_group("General");
    arguments.add_flag("-q,--quiet", reporting.quiet, "Print only errors, and JSON if requested.");
}

void add_verbose_option(Arguments& arguments, Reporting& reporting) {
    arguments.start_group("General");
    arguments.add_flag("-v,--verbose", reporting.verbose, "Print how long each stage took.");
}

void add_general_options(Arguments& arguments, int& threads, Reporting& reporting) {
    add_threads_option(arguments, threads);
    add_json_option(arguments, reporting);
    add_quiet_option(arguments, reporting);
    add_verbose_option(arguments, reporting);
}

}  // namespace marrow::apps
