// Declares the options for reading scans.
#include "scan_arguments.h"

#include <limits>

namespace marrow::apps {

const char* const kScanHelp =
    "DICOM folder or file; NIfTI, NRRD, MetaImage or TIFF file; OME-Zarr folder; folder of slice images";

void add_scan_input(Arguments& arguments, ScanInput& input) {
    arguments.add_input("INPUT", input.path, kScanHelp);
}

void add_scan_options(Arguments& arguments, ScanOptions& options) {
    arguments.start_group("Input");
    arguments.add_option("--series", text_value("SERIES", options.series),
                         "Read this DICOM series: its number in the list of 'marrow info', its UID, or the "
                         "first part of its UID.");
    arguments.add_option("--spacing", spacing_value(options.spacing),
                         "Set the distance between samples in mm, for images that do not state it.");
    arguments.add_flag("--resample", options.resample,
                       "Interpolate unevenly spaced DICOM slices linearly to even spacing.");
    arguments.add_option("--volume",
                         integer_value("K", options.volume, std::numeric_limits<std::int64_t>::min()),
                         "Read volume K of a 4D scan, counted from 0; 'marrow info' lists the volumes.");
    arguments.add_option("--level",
                         integer_value("K", options.level, std::numeric_limits<std::int64_t>::min()),
                         "Read level K of an OME-Zarr image's resolutions, 0 being the finest; 'marrow info' "
                         "lists the levels.");
}

}  // namespace marrow::apps
