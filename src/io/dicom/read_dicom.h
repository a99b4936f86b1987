// DICOM series as volumes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

namespace marrow {

/// The series among `files`, split where their geometry differs. `wanted`: where not empty, the file that the
/// series to choose holds. \throw InputError where there is none.
ScanReport inspect_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                         const ScanOptions& options);

/// Reads one series. \throw as read_scan.
Volume load_dicom(const std::vector<std::filesystem::path>& files, const std::filesystem::path& wanted,
                  const ScanOptions& options, ScanInfo& info);

}  // namespace marrow
