/// Siemens mosaics: all slices of a time point side by side in one image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <marrow/volume.h>

#include "data_set.h"

namespace marrow::internal::io {

/// The slices of a mosaic fill its tiles from left to right, then from top to bottom; the last tiles may be
/// empty.
struct DicomMosaic {
    std::int64_t tiles = 1;  ///< along each side
    std::size_t slices = 1;
    Vec3d step{};       ///< from a slice to the next, mm
    std::string lacks;  ///< what the headers lack, so that nothing else here is known; else empty
};

/// The mosaic that an image is, if ImageType says so. The number of slices and their order come from Siemens'
/// private CSA header.
std::optional<DicomMosaic> read_mosaic(const DicomDataSet& data_set);

}  // namespace marrow::internal::io
