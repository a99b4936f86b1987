/// Reads samples that are stored as in memory, or compressed by zlib: the data of NIfTI, NRRD and MetaImage.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/label_table.h>
#include <marrow/scan_io.h>
#include <marrow/streaming.h>

#include "io/bytes/stored_samples.h"

namespace marrow::internal::io {

/// The content of a header. Its values are plausible but not yet compared with the data.
struct RawImage {
    Geometry geometry;        ///< in LPS
    bool has_spacing = true;  ///< if not, the spacing is 1
    bool oriented = true;     ///< if not, the axes are assumed to be left, posterior, superior
    StoredType type = StoredType::uint8;
    bool big_endian = false;
    bool compressed = false;                   ///< gzip or zlib
    std::vector<std::filesystem::path> files;  ///< in order; each holds the same number of samples
    /// Bytes before the (compressed) data in each file. No value: the data are at the end of the file.
    std::optional<std::int64_t> file_offset = 0;
    std::int64_t data_offset = 0;  ///< bytes before the samples, after decompression
    std::int64_t volumes = 1;      ///< number of volumes
    std::int64_t volume = 0;       ///< index of the volume to read
    /// Whether the samples of all volumes at one place follow each other; else the volumes do.
    bool interleaved = false;
    std::vector<std::string> volume_names;  ///< what distinguishes the volumes, if that is known
    Rescale rescale;                        ///< to apply while reading
    Rescale kept;                           ///< to leave to the volume; the other one is then the identity
    LabelTable labels;                      ///< the names and colours of segments
    std::vector<std::string> warnings;
};

/// Each reads the header of a format. `volume` is the index of the volume, for files with several.
/// \throw IoError; InputError; GeometryError there are several volumes and no index
RawImage read_nifti_header(const std::filesystem::path& path, std::optional<std::int64_t> volume);
RawImage read_nrrd_header(const std::filesystem::path& path, std::optional<std::int64_t> volume);
RawImage read_metaimage_header(const std::filesystem::path& path, std::optional<std::int64_t> volume);

/// Selects one of `count` volumes; all other members of `image` are set already.
/// \throw InputError; GeometryError there are several volumes and no index
void choose_volume(RawImage& image, double count, std::optional<std::int64_t> volume);

/// \throw InputError the files are smaller than the header claims
void check_claims(const RawImage& image);

/// Leaves the rescale to the volume if 8 or 16 bits are then kept instead of becoming float32.
void keep_stored(RawImage& image);

/// Reads the samples, with the type of loaded_type().
/// \throw InputError the files are smaller than the header claims, before memory is allocated; IoError;
/// Cancelled
Volume load_raw(const RawImage& image, const Progress& progress);

/// Reads the same samples slice by slice. \throw the errors of load_raw; InputError they are compressed
SliceSource raw_slices(const RawImage& image);

/// The type of the samples in memory.
SampleType loaded_type(const RawImage& image);

/// Sets spacing and direction from the columns of an index-to-physical matrix.
void set_columns(Geometry& geometry, const Mat3d& index_to_physical);

}  // namespace marrow::internal::io
