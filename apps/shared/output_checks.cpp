// Compares outputs with the files of the input.
#include "output_checks.h"

#include <cerrno>
#include <set>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include "console.h"
#include "values.h"

namespace marrow::apps {
namespace fs = std::filesystem;
namespace {

// Meshes in the folder of a scan may be overwritten. Pictures, tables and DICOM files there may belong to the
// scan, and so may DICOM files and metadata of Zarr in folders below it. Files are compared, not their paths,
// because links in either place lead to the same file.
bool is_of_scan(const fs::path& file, const fs::path& input) {
    std::error_code ignored;
    if (!fs::is_directory(input, ignored)) return fs::equivalent(file, input, ignored);
    if (!fs::exists(file, ignored)) return false;
    const std::string extension = lower_case(file.extension().string());
    const bool may_belong_below = extension == ".dcm" || file.filename() == "zarr.json";
    if (!may_belong_below && extension != ".png" && extension != ".csv" && extension != ".json" &&
        extension != ".svg")
        return false;
    constexpr auto kOptions = fs::directory_options::skip_permission_denied;
    for (fs::recursive_directory_iterator entry(input, kOptions, ignored), end; entry != end;
         entry.increment(ignored)) {
        if (fs::equivalent(entry->path(), file, ignored)) return true;
        if (!may_belong_below) entry.disable_recursion_pending();
    }
    return false;
}

fs::path folder_of(const fs::path& file) {
    return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

[[noreturn]] void refuse_overwriting(const fs::path& file) {
    throw UsageError(fmt::format("'{}' would overwrite the input: give another output", file.string()));
}

}  // namespace

void check_output(const fs::path& file, const fs::path& input) {
    if (file.empty()) return;
    const fs::path folder = folder_of(file);
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
        std::string reason = error.message();
        if (!error || error == std::errc::not_a_directory)
            reason = fmt::format("'{}' is not a folder", folder.string());
        else if (error == std::errc::no_such_file_or_directory)
            reason = fmt::format("there is no folder '{}'; create it first", folder.string());
        throw IoError(fmt::format("cannot write '{}': {}", file.string(), reason));
    }
    if (is_of_scan(file, input)) refuse_overwriting(file);
    // That is found before the work instead of after it.
    if (fs::exists(file, error) && ::faccessat(AT_FDCWD, file.c_str(), W_OK, AT_EACCESS) != 0)
        throw IoError(
            fmt::format("cannot write '{}': {}", file.string(), std::generic_category().message(errno)));
}

void check_not_read(const std::vector<fs::path>& files, const std::vector<fs::path>& scan_files) {
    std::error_code ignored;
    std::set<fs::path> read;
    for (const fs::path& file : scan_files) read.insert(fs::weakly_canonical(file, ignored));
    for (const fs::path& file : files) {
        if (read.contains(fs::weakly_canonical(file, ignored))) refuse_overwriting(file);
    }
}

void check_is_no_slice(const fs::path& picture, const fs::path& input, ScanFormat format) {
    if (format != ScanFormat::slices || lower_case(picture.extension().string()) != ".png") return;
    std::error_code ignored;
    if (fs::equivalent(folder_of(picture), input, ignored))
        throw UsageError(fmt::format(
            "'{}' would become a slice of the scan in its folder: give a picture in another folder",
            picture.string()));
}

bool has_placeholder(const fs::path& file) {
    const std::string name = file.filename().string();
    return file.string().find(kNamePlaceholder) != std::string::npos ||
           name.find('}', name.find('{')) != name.npos;
}

bool has_fixed_axes(MeshFormat format) {
    return format == MeshFormat::glb || format == MeshFormat::dicom;
}

}  // namespace marrow::apps
