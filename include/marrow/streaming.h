/// Isosurfaces of volumes that do not fit in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include <marrow/export.h>
#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow {

/// A volume that is read slice by slice.
struct SliceSource {
    Geometry geometry;
    SampleType type = SampleType::uint8;
    /// Writes slices [z_begin, z_end) to `samples`, in the order of a VolumeView. It is called from one
    /// thread. Several calls in ascending order may read a slab, so that progress is reported between them.
    /// An exception that it throws ends the extraction.
    std::function<void(std::int64_t z_begin, std::int64_t z_end, void* samples)> read;
    /// The slices that are stored together, such as in chunks: read() is called with ranges that begin and
    /// end at multiples of it, or at the end of the volume.
    std::int64_t slices_at_once = 1;
    Rescale rescale = {};        ///< what the samples stand for
    std::size_t read_bytes = 0;  ///< the most memory that read() takes besides `samples`
};

/// A part of a surface. Points and triangles are numbered through the whole surface, and each part holds a
/// range of both. A part has all points that its triangles name. Consecutive parts overlap in points, which
/// are equal in both.
struct SurfacePart {
    std::uint64_t first_point = 0;  ///< the number of points[0] in the whole surface
    std::span<const Vec3f> points;
    std::span<const Vec3f> normals;    ///< as many as points; empty without normals
    std::uint64_t first_triangle = 0;  ///< the number of triangles[0] in the whole surface
    std::span<const Triangle> triangles;
    std::size_t complete_points = 0;  ///< so many of the points, the first ones, are not in the next part
};

/// Receives a surface in parts.
struct SurfaceSink {
    /// Called first, with the numbers of points and triangles of the whole surface, and whether parts have
    /// normals.
    std::function<void(std::uint64_t points, std::uint64_t triangles, bool normals)> begin;
    /// Called with each part, in order. The part's arrays are valid during the call only.
    std::function<void(const SurfacePart& part)> part;
    /// The bytes that the sink itself takes for each point of a part.
    std::size_t bytes_per_point = 0;
};

struct SlabLimits {
    std::size_t memory = std::size_t{1} << 30;  ///< bytes that all arrays and `reserved` together may take
    std::optional<std::int64_t> slices = {};    ///< most slices in a slab; not set: as many as fit in memory
    /// Bytes of `memory` that are taken already, such as by the program itself. The least memory that a
    /// LimitError states includes them, and 4 MiB more, since another run of the program may take a little
    /// more.
    std::size_t reserved = 0;
};

/// Extracts a surface as extract_isosurface does, with only a slab of the volume and of the surface in memory
/// at a time.
///
/// The volume is read twice. The first reading counts, so that the sink learns the size of the surface before
/// it gets the first part. Points, normals and triangles are byte for byte those of extract_isosurface.
/// `options.snap` must be 0. Of `stats`, only the number of samples that are not finite is set, before
/// sink.begin() is called.
///
/// \throw InputError as extract_isosurface, or a function of the source or the sink is missing, or samples
/// changed between the two readings, so that the surface has other points or triangles; LimitError as
/// extract_isosurface, or limits.memory is too little; Cancelled
MARROW_EXPORT void extract_isosurface_in_slabs(const SliceSource& source, double isovalue,
                                               const SurfaceSink& sink, const SlabLimits& limits,
                                               const IsosurfaceOptions& options = {},
                                               IsosurfaceStats* stats = nullptr);

}  // namespace marrow
