/// The options that several commands share.
#pragma once

#include <filesystem>

#include <marrow/mesh_io.h>
#include <marrow/scan_io.h>

#include "arguments.h"

namespace marrow::cli {

/// Where the scan is and how to read it.
struct ScanInput {
    std::filesystem::path path;
    ScanOptions options;  ///< without progress
};

/// Where surfaces go.
struct MeshOutput {
    std::filesystem::path mesh;     ///< file, folder or pattern with {name}; empty: none
    std::filesystem::path picture;  ///< empty: none
    Space space = Space::LPS;
    bool verify = false;  ///< read what was written and compare
};

/// What is printed.
struct Reporting {
    bool json = false;
    bool quiet = false;
    bool verbose = false;
};

/// Adds INPUT, which may be left out so that the message can say more than CLI11; see require_input().
void add_scan_input(Arguments& arguments, ScanInput& input);

/// The help of a scan that is an input.
extern const char* const kScanHelp;

/// The last lines of each help.
extern const char* const kExitCodesHelp;

/// \throw UsageError no INPUT was given
void require_input(const std::filesystem::path& input);

/// \throw UsageError neither -o nor --picture was given
void require_output(const std::filesystem::path& mesh, const std::filesystem::path& picture);

void add_scan_options(Arguments& arguments, ScanOptions& options);
void add_threads_option(Arguments& arguments, int& threads);
void add_mesh_option(Arguments& arguments, std::filesystem::path& mesh);
void add_picture_option(Arguments& arguments, std::filesystem::path& picture);
void add_space_option(Arguments& arguments, Space& space);
void add_json_option(Arguments& arguments, Reporting& reporting);
void add_quiet_option(Arguments& arguments, Reporting& reporting);
void add_verbose_option(Arguments& arguments, Reporting& reporting);

}  // namespace marrow::cli
