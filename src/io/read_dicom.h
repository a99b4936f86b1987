// DICOM series as volumes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

namespace marrow {

/// The series among `files`, split where their geometry differs. \throw InputError where there is none.
std::vector<SeriesInfo> list_dicom(const std::vector<std::filesystem::path>& files,
                                   const ScanOptions& options);

/// Reads one series. `wanted`: where not empty, the series this file belongs to.
/// \throw as read_scan.
Volume load_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                  const ScanOptions& options, ScanInfo& info);

}  // namespace marrow
