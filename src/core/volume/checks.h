/// Checks of arguments and results that the entry points share.
#pragma once

#include <cstdint>

#include <marrow/volume.h>

namespace marrow::internal {

/// \throw InputError a slope that is not positive, or numbers that are not finite
void check_rescale(const Rescale& rescale);
/// \throw InputError bad geometry, a bad rescale, samples that overlap, or a null pointer to the samples
void check_volume(const VolumeView& volume);
/// \throw InputError the samples stand for other values, as those of a label map never do
void check_not_rescaled(const VolumeView& map);
/// The isovalue as a sample. Every entry point converts it here, once; all that follows works on samples.
/// \throw InputError the isovalue, or the sample, is NaN or infinite
double checked_isovalue(double isovalue, const Rescale& rescale);
/// \throw LimitError more points than the indices of triangles can name
void check_point_count(std::uint64_t points);
/// \throw LimitError always: a volume of this size needs more memory than there is
[[noreturn]] void throw_out_of_memory(const Geometry& geometry);
/// Whether the grid has any cell; without cells there is no surface. A `closed` grid has a layer of samples
/// more on every side.
bool has_cells(const Geometry& geometry, bool closed);

}  // namespace marrow::internal
