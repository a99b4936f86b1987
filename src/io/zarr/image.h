/// Images in OME-Zarr, and plain Zarr arrays, as volumes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "array.h"

namespace marrow::internal::io {

/// One volume of an image, at one level of its resolution pyramid.
struct ZarrImage {
    ZarrArray array;
    Geometry geometry;
    bool has_units = false;                           ///< whether the metadata state units of length
    bool has_spacing = false;                         ///< or at least numbers, which are taken for mm
    bool oriented = false;                            ///< whether they state where the axes run in the body
    std::vector<std::array<std::int64_t, 3>> levels;  ///< the size of each level
    std::vector<std::string> volumes;                 ///< what distinguishes each volume; one if there is one
    std::optional<std::int64_t> volume;               ///< the one that is read; no value: none was chosen
    ZarrArray::Index first;                           ///< the first sample of the volume
    std::vector<std::string> warnings;
};

/// Reads the metadata of a folder: OME-Zarr 0.4 and 0.5, or an array with three axes. Without
/// ScanOptions::volume, the first of several volumes is described, and `volume` has no value.
/// \throw IoError; InputError they are damaged or not supported; OptionError there is no such volume or level
ZarrImage read_zarr_image(const std::filesystem::path& folder, const ScanOptions& options);

/// The type of the samples in memory.
SampleType loaded_type(const ZarrImage& image);

/// Reads the samples. \throw the errors of read_zarr; LimitError; Cancelled
Volume load_zarr(const ZarrImage& image, const ScanOptions& options);

/// Reads the same samples slice by slice. `threads`: as ScanOptions::threads
SliceSource zarr_slices(ZarrImage image, int threads);

/// Reads boxes of the same samples.
BoxSource zarr_boxes(ZarrImage image);

}  // namespace marrow::internal::io
