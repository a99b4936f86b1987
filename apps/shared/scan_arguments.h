/// The input of all programs that read scans, and the options for reading it.
#pragma once

#include <filesystem>

#include <marrow/scan_io.h>

#include "arguments.h"

namespace marrow::apps {

/// Where the scan is and how to read it.
struct ScanInput {
    std::filesystem::path path;
    ScanOptions options{.keep_stored = true};  ///< without progress
};

/// The help of a scan that is an input.
extern const char* const kScanHelp;

/// Adds INPUT, which may be left out so that the message can say more than CLI11; see require_input().
void add_scan_input(Arguments& arguments, ScanInput& input);

/// Adds the options for reading, in the group "Input".
void add_scan_options(Arguments& arguments, ScanOptions& options);

}  // namespace marrow::apps
