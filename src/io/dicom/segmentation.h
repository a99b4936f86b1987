/// Reads DICOM segmentations as label maps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <marrow/scan_io.h>

#include "file.h"

namespace marrow::internal::io {

/// The label maps of a segmentation. Segments that overlap are in different maps: each is in the first map
/// where it has room.
struct LabelMaps {
    std::vector<Volume> maps;                       ///< uint8, or uint16 if a label needs it
    std::vector<std::vector<std::int64_t>> labels;  ///< of each map, ascending; empty for a stored label map
    std::vector<std::string> warnings;
};

/// Reads the label maps of a file. Slices without a frame are background. Fractions count from half of the
/// largest on.
/// \pre file.segmentation. \throw the errors of decode_dicom; GeometryError the frames are not on one grid
LabelMaps read_label_maps(const DicomFile& file, const ScanOptions& options);

/// The segmentation in a data set, if it is one. \throw InputError a sequence is damaged
std::optional<DicomSegmentation> read_segmentation(const DicomDataSet& data_set);

}  // namespace marrow::internal::io
