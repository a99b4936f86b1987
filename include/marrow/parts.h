/// Isosurfaces of volumes that are larger than one machine, extracted in parts by any number of processes.
///
/// A part is a box of the volume's cells. Its view has the samples at the corners of these cells, so that
/// neighbouring parts share a layer of samples, and `VolumeView::first` says where it lies. Normals read one
/// sample more on each side, where the whole volume has one: `below` and `above` say that it is there. The
/// results have the bytes of extract_isosurface of the whole, for any way to cut it.
///
/// There are two ways to put parts together. Small surfaces are merged in memory: extract_part() by each
/// process, then merge_parts(). Surfaces of any size are numbered first and then written by all processes at
/// the same time, to one file (see mesh_io.h): count_part() by each process, number_parts() by one, then
/// extract_numbered_part() by each again. This continues the histogram pyramid above the processes. A part
/// that is read from a store twice can leave out chunks_without_surface() the second time.
///
/// In all functions `whole` are the dims of the whole volume. With `options.closed` the surface is closed at
/// the border of the whole, not between parts. `options.snap` must be 0. All throw InputError as
/// extract_isosurface, for a view that leaves the whole, for a missing sample for normals, and for parts of
/// which some have exact topology and some have not; LimitError not enough memory, or keys that do not fit in
/// 64 bits; Cancelled, except number_parts() and first_slice(), which report no progress.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/export.h>
#include <marrow/isosurface.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/volume.h>

namespace marrow {

/// A box of samples in the grid of a whole volume. If the surface is closed, the grid has a layer of samples
/// more than the volume on every side, as outside samples seem to surround it.
struct PartExtent {
    std::array<std::int64_t, 3> whole{};  ///< samples of the whole grid
    std::array<std::int64_t, 3> first{};  ///< index in the grid of the box's first sample
    std::array<std::int64_t, 3> dims{};   ///< samples of the box

    friend bool operator==(const PartExtent&, const PartExtent&) = default;
    /// The samples along an axis whose points the part owns: all but the last, which begins the next part.
    /// Points belong to the sample at which their edge starts.
    std::int64_t owned(std::size_t axis) const {
        return dims[axis] - (first[axis] + dims[axis] < whole[axis] ? 1 : 0);
    }
};

/// The surface of a part. It has all points that its triangles name, so that neighbouring parts share points.
struct MARROW_EXPORT PartSurface {
    PartExtent extent;
    Mesh mesh;
    /// What tells each point from all others of the whole grid, in ascending order. Let k be
    /// keys_per_sample(). A point on the edge along `axis` from sample (x, y, z) has the key
    /// ((z * ny + y) * k + axis) * nx + x. With exact topology, point i of up to six inside the cell
    /// that begins there has ((z * ny + y) * k + 3) * nx + 6 * x + i.
    Buffer<std::uint64_t> keys;
    bool topology = false;  ///< as IsosurfaceOptions::topology

    /// 3 for the edges that start at a sample, and with exact topology 6 more for the points inside a cell.
    std::uint64_t keys_per_sample() const { return keys_per_sample(topology); }
    static constexpr std::uint64_t keys_per_sample(bool topology) { return topology ? 9 : 3; }
    /// More than any key of the whole grid. \throw LimitError it does not fit in 64 bits
    std::uint64_t key_count() const;
};

/// Extracts the surface of a part.
MARROW_EXPORT PartSurface extract_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                                       double isovalue, const IsosurfaceOptions& options = {});

/// Merges the surfaces of parts, in any order, which together have all cells of a volume, each once: the
/// bytes of extract_isosurface. Points are equal if their keys are; coordinates are not compared. \pre
/// extract_part() made the parts. \throw InputError parts of different volumes, some with and some without
/// normals, with more or fewer cells than the volume, or with triangles of the same cell; LimitError more
/// than 2^32 - 1 points, or not enough memory; Cancelled
MARROW_EXPORT Mesh merge_parts(std::span<const PartSurface> parts, const Progress& progress = {});

/// Numbers of points and triangles.
struct SurfaceSize {
    std::uint64_t points = 0, triangles = 0;

    friend bool operator==(const SurfaceSize&, const SurfaceSize&) = default;
};

/// What a part adds to the surface. Its rows are the owned(1) * owned(2) rows of samples that it owns, y
/// fastest.
struct MARROW_EXPORT PartCounts {
    PartExtent extent;
    /// For each row the points on its owned edges along x, y and z, and with `topology` those inside the
    /// cells that begin at its samples.
    std::vector<std::uint32_t> points;
    std::vector<std::uint32_t> triangles;  ///< for each row those of the cells that begin at its samples
    bool topology = false;                 ///< as IsosurfaceOptions::topology

    SurfaceSize total() const;
};

/// Counts the points and triangles of a part. It needs no samples beside those of the view.
MARROW_EXPORT PartCounts count_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                                    double isovalue, const IsosurfaceOptions& options = {});

/// The counts of a part's first slice, which is all that number_parts() needs of the parts that follow.
MARROW_EXPORT PartCounts first_slice(const PartCounts& counts);

/// Where the points and triangles of a part lie in those of the whole surface. Its rows are the dims[1] *
/// dims[2] rows of samples of the part, y fastest.
struct PartNumbers {
    PartExtent extent;
    /// For each row the number of the first point along x, y and z, and with `topology` inside a cell.
    std::vector<std::uint32_t> points;
    std::vector<std::uint64_t> triangles;  ///< for each row the number of the first triangle
    bool topology = false;                 ///< as IsosurfaceOptions::topology
    /// Of the counts of the rows that the part owns: extract_numbered_part() refuses samples with others.
    std::uint64_t counts_hash = 0;
};

/// Numbers the points and triangles of parts, in the order of `parts`, which are all between two cuts across
/// z.
///
/// The volume must be cut by planes: parts that begin at the same x have all rows between the two cuts.
/// `next` are the counts of the parts that begin at the second cut, of which only the first slice is read; it
/// is empty at the end of the volume. `before` is the size of the surface before the first cut. \throw
/// InputError parts of different volumes, or parts that overlap or leave a gap; LimitError more than 2^32 - 1
/// points
MARROW_EXPORT std::vector<PartNumbers> number_parts(std::span<const PartCounts> parts,
                                                    std::span<const PartCounts> next = {},
                                                    const SurfaceSize& before = {});

/// Elements of a part that follow each other in the whole surface too.
struct NumberedRun {
    std::uint64_t number = 0;  ///< of the run's first element in the whole surface
    std::size_t begin = 0;     ///< its index in the part
    std::size_t count = 0;
};

/// The surface of a part, and the places in the whole surface of what the part owns.
struct NumberedPart {
    static constexpr std::uint32_t kNoNumber = ~std::uint32_t{0};

    /// With all points that its triangles name, also those that other parts own. If there are normals, it has
    /// all triangles around the points that the part owns, so that turn_normals_outward() turns the same ones
    /// as in the whole surface. Only those in the runs are the part's.
    Mesh mesh;
    /// The number of each point in the whole surface; kNoNumber if only triangles of other parts name it. Its
    /// normal then has no meaning.
    Buffer<std::uint32_t> numbers;
    std::vector<NumberedRun> points, triangles;  ///< what the part owns
};

/// Extracts the surface of a part that was numbered. \throw InputError `numbers` belong to another part, or
/// the samples have changed since they were counted, so that rows of the part have other numbers of them
MARROW_EXPORT NumberedPart extract_numbered_part(const VolumeView& part, const PartNumbers& numbers,
                                                 double isovalue, const IsosurfaceOptions& options = {});

/// Which chunks of the samples need not be read again to extract a numbered part, if they are stored in
/// chunks of `chunk` samples, the first at index 0. One number for each chunk that `part`, or the sample
/// around it, overlaps, x fastest: 1 if the surface does not depend on the values in it, else 0. Any sample
/// of the chunk within the part, or beside it, can then stand for all of them. \throw InputError also a chunk
/// without samples
MARROW_EXPORT std::vector<std::uint8_t> chunks_without_surface(const VolumeView& part,
                                                               const std::array<std::int64_t, 3>& whole,
                                                               const std::array<std::int64_t, 3>& chunk,
                                                               double isovalue,
                                                               const IsosurfaceOptions& options = {});

}  // namespace marrow
