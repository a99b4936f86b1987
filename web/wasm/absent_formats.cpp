// The formats that browsers are not given.
#include <marrow/error.h>

#include "io/bytes/text.h"
#include "io/dicom/encapsulated_stl.h"
#include "io/zarr/image.h"

namespace marrow::internal::io {

// A folder of Zarr is told from others by its files' names, so that it can be refused.
bool is_zarr(const std::filesystem::path& folder) {
    for (const char* name : {"zarr.json", ".zattrs", ".zarray", ".zgroup"}) {
        if (std::filesystem::exists(folder / name)) return true;
    }
    return false;
}

ZarrImage read_zarr_image(const std::filesystem::path& folder, const ScanOptions&) {
    fail<InputError>(folder, "is OME-Zarr, which is not read in browsers; convert it to NIfTI or NRRD");
}

// What follows takes an image, which cannot be had.

SampleType loaded_type(const ZarrImage& image) {
    fail<InputError>(image.array.folder, "is OME-Zarr");
}

Volume load_zarr(const ZarrImage& image, const ScanOptions&) {
    fail<InputError>(image.array.folder, "is OME-Zarr");
}

SliceSource zarr_slices(ZarrImage image, int) {
    fail<InputError>(image.array.folder, "is OME-Zarr");
}

BoxSource zarr_boxes(ZarrImage image) {
    fail<InputError>(image.array.folder, "is OME-Zarr");
}

StlWrapping wrap_stl(const StlObject&) {
    throw InputError("DICOM objects are not written in browsers; write .stl, .3mf, .glb or .ply");
}

}  // namespace marrow::internal::io
