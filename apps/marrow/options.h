/// The options that several commands share.
#pragma once

#include <filesystem>
#include <string_view>

#include <marrow/mesh_io.h>

#include "shared/arguments.h"
#include "shared/scan_arguments.h"

namespace marrow::apps {

/// Where surfaces go.
struct MeshOutput {
    std::filesystem::path mesh;     ///< file, folder or pattern with {name}; empty: none
    std::filesystem::path picture;  ///< empty: none
    Space space = Space::LPS;
    bool keep_patient = false;  ///< in .dcm
    bool verify = false;        ///< read what was written and compare
};

/// What is printed.
struct Reporting {
    bool json = false;
    bool quiet = false;
    bool verbose = false;
};

/// The last lines of each help.
extern const char* const kExitCodesHelp;

/// `command` is the one whose help is named. \throw UsageError no INPUT was given
void require_input(const std::filesystem::path& input, std::string_view command);

/// \throw UsageError neither -o nor --picture was given
void require_output(const std::filesystem::path& mesh, const std::filesystem::path& picture);

void add_mesh_option(Arguments& arguments, std::filesystem::path& mesh, const std::string& formats);
void add_picture_option(Arguments& arguments, std::filesystem::path& picture);
void add_space_option(Arguments& arguments, Space& space);

/// The options of the group "General", which begins with the first of them.
void add_threads_option(Arguments& arguments, int& threads);
void add_json_option(Arguments& arguments, Reporting& reporting);
void add_quiet_option(Arguments& arguments, Reporting& reporting);
void add_verbose_option(Arguments& arguments, Reporting& reporting);
void add_general_options(Arguments& arguments, int& threads, Reporting& reporting);  ///< all of them

}  // namespace marrow::apps
