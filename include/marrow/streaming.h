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
    /// Reads slices [z_begin, z_end) as they lie in a VolumeView. Called from one thread; what it throws ends the work.
    std::function<void(std::int64_t z_begin, std::int64_t z_end, void* samples)> read;
};

/// A run of a surface's points and of its triangles, which are numbered through the whole surface. The points hold all
/// that the triangles name; parts overlap in points, which are then the same.
struct SurfacePart {
    std::uint64_t first_point = 0;
    std::span<const Vec3f> points;
    std::span<const Vec3f> normals;  ///< empty without normals
    std::uint64_t first_triangle = 0;
    std::span<const Triangle> triangles;
};

/// Takes a surface in parts.
struct SurfaceSink {
    /// Called first, with the size of the whole; normals: whether parts will have them.
    std::function<void(std::uint64_t points, std::uint64_t triangles, bool normals)> begin;
    /// Called with each part, in order. Its memory is taken back afterwards.
    std::function<void(const SurfacePart& part)> part;
};

struct SlabLimits {
    std::size_t memory = std::size_t{1} << 30;  ///< bytes to stay within, all arrays together
    std::optional<std::int64_t> slices = {};    ///< most slices at a time; not set: as many as memory allows
};

/// As extract_isosurface, with only a slab of the volume and of the surface in memory at a time. The volume is read twice:
/// first to count, so that the size of the whole is known before its first part. The points and triangles are byte for byte
/// those of extract_isosurface. \throw as extract_isosurface, and LimitError where limits.memory is too little
MARROW_EXPORT void extract_isosurface_in_slabs(const SliceSource& source, double isovalue,
                                               const SurfaceSink& sink, const SlabLimits& limits,
                                               const IsosurfaceOptions& options = {},
                                               IsosurfaceStats* stats = nullptr);

}  // namespace marrow
