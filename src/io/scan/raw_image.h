// Samples that lie in a file as they are in memory, or gzipped: what NIfTI, NRRD and MetaImage come down to.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/scan_io.h>
#include <marrow/streaming.h>

namespace marrow {

/// The types a file can hold. Those that a Volume has not become float64, exactly or not at all.
enum class StoredType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32, float64 };

/// What a header says, checked for sense but not yet against the data.
struct RawImage {
    Geometry geometry;        ///< in LPS
    bool has_spacing = true;  ///< false: the spacing is 1 for want of a better one
    StoredType type = StoredType::uint8;
    bool big_endian = false;
    bool compressed = false;                   ///< gzip or zlib
    std::vector<std::filesystem::path> files;  ///< in order, of equal shares
    std::int64_t file_offset =
        0;  ///< bytes before the (compressed) data in each file; -1: they end with the file
    std::int64_t data_offset = 0;  ///< bytes before the samples, counted after decompression
    std::int64_t volumes = 1;      ///< of this size that lie one after the other
    std::int64_t volume = 0;       ///< the one to read
    double slope = 1;              ///< value = slope * stored + intercept
    double intercept = 0;
    std::vector<std::string> warnings;
};

/// What the three headers say. `volume`: which one of several, counted from 0.
/// \throw IoError, InputError; GeometryError where there are several volumes and none is named.
RawImage read_nifti_header(const std::filesystem::path& path, std::optional<std::int64_t> volume);
RawImage read_nrrd_header(const std::filesystem::path& path);
RawImage read_metaimage_header(const std::filesystem::path& path, std::optional<std::int64_t> volume);

/// Makes `image`, which is otherwise complete, the named one of `count` volumes that lie one after the other.
/// \throw as above.
void choose_volume(RawImage& image, double count, std::optional<std::int64_t> volume);

/// \throw InputError where the files are smaller than the header claims.
void check_claims(const RawImage& image);

/// Reads the samples. The type stays as stored; where slope and intercept ask for it, and for types that a
/// Volume has not, it is float32 or, where float32 would not be exact, float64. \throw InputError where the
/// files are smaller than the header claims, before memory is allocated.
Volume load_raw(const RawImage& image, const Progress& progress);

/// The same samples, slice by slice. \throw as load_raw, and InputError where they are compressed.
SliceSource raw_slices(const RawImage& image);

/// The type load_raw will give.
SampleType loaded_type(const RawImage& image);

/// Sets spacing and direction from the columns of an index-to-millimetre matrix, where not all zero.
void set_columns(Geometry& geometry, const Mat3d& index_to_physical);

}  // namespace marrow
