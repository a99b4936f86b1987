/// Finds the series among DICOM files and chooses one.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "file.h"
#include "stack.h"

namespace marrow::internal::io {

/// The DICOM files of an input.
struct DicomInput {
    std::vector<std::filesystem::path> files;
    std::optional<std::filesystem::path> named;  ///< if the input is one file; it stands for its series
};

/// The headers of an input's files, grouped into series.
struct DicomHeaders {
    std::vector<DicomFile> files;
    std::vector<DicomSeries> series;  ///< they point into `files`
    std::vector<std::string> warnings;
    std::optional<std::string> damage;  ///< the error of a damaged file, which may belong to any series
};

/// Reads the headers of all files. \throw IoError; InputError no file holds an image, or the named file is
/// damaged; Cancelled
DicomHeaders read_dicom_headers(const DicomInput& input, int threads, const Progress& progress);

/// Describes a stack, as far as its headers allow.
SeriesInfo describe(const DicomStack& stack);

/// The series that read_scan could read.
struct SeriesChoice {
    std::vector<DicomSeries*> candidates;
    std::string reason;                ///< why these
    bool skips_single_images = false;  ///< whether scouts or single images are skipped
};

/// \throw OptionError options.series does not exist; InputError the named file holds no image
SeriesChoice choose_series(DicomHeaders& headers, const DicomInput& input, const ScanOptions& options);

/// \throw GeometryError there are several candidates
DicomSeries& only_candidate(const SeriesChoice& choice, const DicomHeaders& headers);

/// A warning if images with the SeriesInstanceUID of this series are not in it, as they are of another size,
/// direction or spacing, or in another place; empty if there are none, or if options.series chose
/// this one. Scouts do not count.
std::string images_left_out(const DicomSeries& series, const DicomHeaders& headers,
                            const ScanOptions& options);

/// Which of several volumes options.volume chooses, or the only one. `differences` tell them apart; `what`
/// begins the message that there are several: "the series holds 2 volumes".
/// \throw GeometryError there are several and no choice; OptionError there is none of that number
std::size_t choose_volume(const std::vector<std::string>& differences, const std::string& what,
                          const ScanOptions& options);

}  // namespace marrow::internal::io
