// Extracts surfaces of volumes that do not fit in memory, slab by slab: reads the volume once to count, and
// once more to make points and triangles.
#include <marrow/streaming.h>

#include <algorithm>
#include <atomic>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "core/grid/shares.h"
#include "core/marching_cubes/ambiguous_cells.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/count.h"
#include "core/marching_cubes/emit.h"
#include "core/volume/checks.h"
#include "core/volume/second_reading.h"
#include "core/volume/sparse_array.h"

namespace marrow {

using namespace internal;

namespace {

// Divides the limit among the arrays. The sizes of these follow from the numbers of samples, so that a limit
// that is too low is refused before there are any arrays.
class SlabMemory {
  public:
    // \throw LimitError not even slabs without output fit
    SlabMemory(const SliceSource& source, const SlabLimits& limits, const IsosurfaceOptions& options)
        : limit_(limits.memory), margin_(limits.reserved > 0 ? kMargin : 0) {
        const Geometry& geometry = source.geometry;
        checked_size(static_cast<std::uint64_t>(geometry.sample_count()), sample_size(source.type));
        const InsideBits bits(geometry.dims, ClosedSides::all(options.closed), nullptr);
        slices_ = bits.nz;
        halo_ = kHalo + std::min(source.slices_at_once, geometry.dims[2]) - 1;
        bytes_per_slice_ =
            static_cast<std::size_t>(geometry.dims[0] * geometry.dims[1]) * sample_size(source.type) +
            bits.row_index(0, 1) * bits.words_per_row * sizeof(std::uint64_t);
        // RowCounts has four numbers per row, and the levels of the two pyramids above its rows add up to
        // less than two bytes per row. Any row may have ambiguous cells. Each slice has a hash.
        const std::size_t bytes_per_row = 4 * sizeof(std::uint32_t) + 2 +
                                          ActiveWords::masks_per_row_of(bits) * sizeof(std::uint64_t) +
                                          (options.topology ? sizeof(AmbiguousRow) : 0);
        fixed_ = limits.reserved + source.read_bytes +
                 bytes_per_row * checked_size(bits.rows(), bytes_per_row) +
                 sizeof(std::uint64_t) * static_cast<std::size_t>(bits.nz);
        divide(0);
    }

    // Sets the memory of slabs of which one of a single slice has at most so many bytes of output. Pages are
    // huge unless such a slab then would not fit. \throw LimitError it does not fit
    void divide(std::size_t output) {
        const std::size_t least = fixed_ + window_bytes(1) + output;
        if (limit_ < least)
            throw LimitError("limits.memory must be at least " +
                             std::to_string(((least + margin_) >> 20) + 1) + " MiB for this " +
                             (output > 0 ? "surface" : "volume, and more for its surface"));
        huge_pages_ = limit_ >= kLeastForHugePages && limit_ - least >= kRounding;
        of_slab_ = limit_ - fixed_ - (huge_pages_ ? kRounding : 0);
    }

    bool huge_pages() const { return huge_pages_; }
    // The bytes of a slab's samples, bits and output.
    std::size_t of_slab() const { return of_slab_; }
    // The bytes of a slab's samples and bits, with those around it.
    std::size_t window_bytes(std::int64_t slices) const {
        return static_cast<std::size_t>(std::min(slices + halo_, slices_)) * bytes_per_slice_;
    }
    // The slices of a slab without output: as many as fit, and at least one.
    std::int64_t slices_that_fit() const {
        return std::max<std::int64_t>(static_cast<std::int64_t>(of_slab_ / bytes_per_slice_) - halo_, 1);
    }

  private:
    // Stencils reach one slice back and two ahead, and the last slice of points
    // is made with the slab before it.
    static constexpr std::int64_t kHalo = 5;
    // Five arrays are rounded up to huge pages of 2 MiB at both ends, which should
    // be a small part of the memory.
    static constexpr std::size_t kRounding = std::size_t{5} * 2 * 2 << 20;
    static constexpr std::size_t kLeastForHugePages = 16 * kRounding;
    // By so much another run of the program may have reserved more.
    static constexpr std::size_t kMargin = std::size_t{4} << 20;

    const std::size_t limit_, margin_;
    std::int64_t slices_ = 0;          // of the grid
    std::int64_t halo_ = 0;            // slices in memory beside those of a slab
    std::size_t bytes_per_slice_ = 0;  // of its samples and bits
    std::size_t fixed_ = 0;            // bytes that are taken whatever the slab
    bool huge_pages_ = false;
    std::size_t of_slab_ = 0;
};

// The volume's samples and inside bits, of which only a window of slices is in memory. Slices are numbered as
// in the grid, which for a closed surface has one more at both ends than the volume.
class Window {
  public:
    Window(const SliceSource& source, double isovalue, bool closed)
        : source_(source),
          isovalue_(isovalue),
          slice_samples_(static_cast<std::size_t>(source.geometry.dims[0] * source.geometry.dims[1])),
          slice_bytes_(slice_samples_ * sample_size(source.type)),
          slices_at_once_(std::min(source.slices_at_once, source.geometry.dims[2])),
          piece_(std::max<std::int64_t>(
                     static_cast<std::int64_t>(kPieceBytes / slice_bytes_) / slices_at_once_, 1) *
                 slices_at_once_),
          samples_(slice_bytes_ * static_cast<std::size_t>(source.geometry.dims[2])),
          bit_memory_(InsideBits(source.geometry.dims, ClosedSides::all(closed), nullptr).word_count() +
                      InsideBits::kSlack),
          bits_(source.geometry.dims, ClosedSides::all(closed), bit_memory_.data()),
          hashes_(static_cast<std::size_t>(bits_.nz)) {
        volume_.geometry = source.geometry;
        volume_.type = source.type;
        volume_.data = samples_.data();
    }

    const VolumeView& volume() const { return volume_; }
    const InsideBits& bits() const { return bits_; }
    std::int64_t non_finite_samples() const { return non_finite_; }

    void use_huge_pages(bool huge) {
        samples_.use_huge_pages(huge);
        bit_memory_.use_huge_pages(huge);
    }

    // Begins again with the first slice. Now the slices must have the bits that they had before.
    void rewind() {
        release(bits_.nz);
        read_ = classified_ = released_ = released_bits_ = 0;
        non_finite_ = 0;
        is_second_reading_ = true;
    }

    // Reads and classifies all slices before `end` that were not read yet, and reads the samples of `ahead`
    // more slices, and of those that are stored together with these.
    void advance(std::int64_t end, std::int64_t ahead, const Progress& progress) {
        const std::int64_t nz = source_.geometry.dims[2];
        const std::int64_t needed = end - bits_.first_z + ahead;
        const std::int64_t samples_end = std::clamp<std::int64_t>(
            (needed + slices_at_once_ - 1) / slices_at_once_ * slices_at_once_, read_, nz);
        const std::int64_t bits_end = std::clamp(end, classified_, bits_.nz);
        Stage stage(progress, 0, 1, static_cast<std::size_t>(samples_end - read_ + bits_end - classified_));
        while (read_ < samples_end) {
            const std::int64_t begin = read_;
            read_ = std::min(begin + piece_, samples_end);
            source_.read(begin, read_, samples_.data() + slice_bytes_ * static_cast<std::size_t>(begin));
            stage.step(static_cast<double>(read_ - begin));
        }
        std::atomic<std::int64_t> non_finite = 0;
        parallel_for(classified_, bits_end, [&](std::int64_t z) {
            non_finite += classify_slice(volume_, isovalue_, z, bits_, nullptr);
            check_unchanged(z);
            stage.step();
        });
        non_finite_ += non_finite;
        classified_ = bits_end;
    }

    // Releases the bits of slices before `end`, and the samples of slices before `end` - `kept`.
    void release(std::int64_t end, std::int64_t kept = 0) {
        const std::int64_t samples_end =
            std::clamp<std::int64_t>(end - bits_.first_z - kept, released_, read_);
        samples_.release(slice_bytes_ * static_cast<std::size_t>(released_),
                         slice_bytes_ * static_cast<std::size_t>(samples_end));
        released_ = samples_end;
        const std::int64_t bits_end = std::clamp<std::int64_t>(end, released_bits_, classified_);
        bit_memory_.release(words_per_slice() * static_cast<std::size_t>(released_bits_),
                            words_per_slice() * static_cast<std::size_t>(bits_end));
        released_bits_ = bits_end;
    }

  private:
    // So many bytes are read within a fraction of a second, after which progress is reported.
    static constexpr std::size_t kPieceBytes = std::size_t{32} << 20;

    std::size_t words_per_slice() const { return bits_.row_index(0, 1) * bits_.words_per_row; }

    // The counts of the first reading are those of the second one only if the bits are.
    void check_unchanged(std::int64_t z) {
        const std::uint64_t hash = hash_of({bits_.row(bits_.row_index(0, z)), words_per_slice()});
        std::uint64_t& before = hashes_[static_cast<std::size_t>(z)];
        if (!is_second_reading_) before = hash;
        if (hash != before) throw_samples_changed();
    }

    const SliceSource& source_;
    const double isovalue_;
    const std::size_t slice_samples_, slice_bytes_;
    const std::int64_t slices_at_once_;
    const std::int64_t piece_;  // the most slices that are read by one call, unless more are stored together
    SparseArray<std::byte> samples_;
    SparseArray<std::uint64_t> bit_memory_;
    InsideBits bits_;
    std::vector<std::uint64_t> hashes_;  // of each slice's bits
    VolumeView volume_;
    // In memory are the samples of the volume's slices from released_ to read_, and the bits of the grid's
    // slices from released_bits_ to classified_.
    std::int64_t read_ = 0, released_ = 0;
    std::int64_t classified_ = 0, released_bits_ = 0;
    std::int64_t non_finite_ = 0;
    bool is_second_reading_ = false;
};

// Everything that the passes share.
struct Slabs {
    Slabs(const SliceSource& source, double level, const SurfaceSink& sink, const SlabLimits& limits,
          const IsosurfaceOptions& slab_options)
        : isovalue(level),
          options(slab_options),
          memory(source, limits, slab_options),
          window(source, level, slab_options.closed),
          rows(window.bits().rows()),
          active(window.bits()),
          to_physical(window.volume()),
          most_slices(limits.slices.value_or(window.bits().nz)),
          sink_bytes_per_point(sink.bytes_per_point) {
        window.use_huge_pages(memory.huge_pages());
        if (options.topology) ambiguous.emplace(window.volume(), isovalue, to_physical, window.bits());
    }

    // The part of a pass that slices [z, end) are.
    Progress slab_progress(const Progress& pass, std::int64_t z, std::int64_t end) const {
        const auto slices = static_cast<double>(window.bits().nz);
        return sub_progress(pass, static_cast<double>(z) / slices, static_cast<double>(end) / slices);
    }

    const double isovalue;
    const IsosurfaceOptions& options;
    SlabMemory memory;  // before the arrays, which are made only if they fit
    Window window;
    RowCounts rows;
    ActiveWords active;
    const IndexToPhysical to_physical;
    // With exact topology. Between the two readings only the rows that have such cells are kept, so that the
    // memory does not depend on the surface.
    std::optional<AmbiguousCells> ambiguous;
    const std::int64_t most_slices;  // in a slab
    const std::size_t sink_bytes_per_point;
};

// The histogram pyramids over rows.
struct Pyramids {
    HistoPyramid points, triangles;
};

// Reads the volume for the first time, and counts what every row makes.
Pyramids count(Slabs& s, const Progress& progress) {
    Window& window = s.window;
    const InsideBits& bits = window.bits();
    const std::int64_t slices = std::min(s.most_slices, s.memory.slices_that_fit());
    for (std::int64_t z = 0; z < bits.nz; z += slices) {
        const std::int64_t end = std::min(z + slices, bits.nz);
        const Progress of_slab = s.slab_progress(progress, z, end);
        window.advance(end + 1, 0, sub_progress(of_slab, 0, 0.9));
        Stage stage(of_slab, 0.9, 1, static_cast<std::size_t>(end - z));
        parallel_for(z, end, [&](std::int64_t slice) {
            if (s.ambiguous) {
                s.ambiguous->count(slice, s.rows, s.active);
                s.ambiguous->forget(slice);
            } else {
                count_rows(bits, bits.row_index(0, slice), bits.row_index(0, slice + 1), s.rows, s.active);
            }
            stage.step();
        });
        // The bits that the next slab begins with are there already, so none of the samples is needed again,
        // except those that ambiguous cells ask.
        window.release(end, s.ambiguous ? 0 : -1);
    }
    parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t slice) {
        count_triangles(bits, bits.row_index(0, slice), bits.row_index(0, slice + 1), s.rows);
    });
    for (std::int64_t slice = 0; s.ambiguous && slice < bits.nz; ++slice) s.ambiguous->add_to(s.rows, slice);
    return {HistoPyramid(std::move(s.rows.points)), HistoPyramid(std::move(s.rows.triangles))};
}

// The output of slices [z_begin, z_end): triangles between them and the slice after, and all points that
// these name.
struct SlabOutput {
    std::size_t row_begin, row_end, points_row_end;
    std::uint64_t point_begin, next_point_begin, point_end, triangle_begin, triangle_end;
    std::uint64_t point_triangle_end;  // of the rows that have these points

    SlabOutput(const InsideBits& bits, const Pyramids& pyramids, std::int64_t z_begin, std::int64_t z_end)
        : row_begin(bits.row_index(0, z_begin)),
          row_end(bits.row_index(0, z_end)),
          points_row_end(bits.row_index(0, std::min(z_end + 1, bits.nz))),
          point_begin(pyramids.points.first_output(row_begin)),
          next_point_begin(z_end < bits.nz ? pyramids.points.first_output(row_end)
                                           : pyramids.points.first_output(points_row_end)),
          point_end(pyramids.points.first_output(points_row_end)),
          triangle_begin(pyramids.triangles.first_output(row_begin)),
          triangle_end(pyramids.triangles.first_output(row_end)),
          point_triangle_end(pyramids.triangles.first_output(points_row_end)) {}

    std::uint64_t points() const { return point_end - point_begin; }
    std::uint64_t triangles() const { return triangle_end - triangle_begin; }
    // Each has at least two triangles.
    std::uint64_t most_ambiguous_cells() const { return (point_triangle_end - triangle_begin) / 2; }
};

// The bytes that a slab's output takes here and in the sink, with its ambiguous
// cells and as much for finding them.
std::size_t output_bytes(const Slabs& s, const SlabOutput& slab) {
    const std::uint64_t cells = s.options.topology ? 2 * slab.most_ambiguous_cells() : 0;
    return cells * sizeof(AmbiguousCell) +
           slab.points() * (sizeof(Vec3f) * (s.options.normals ? 2 : 1) + s.sink_bytes_per_point) +
           slab.triangles() * sizeof(Triangle);
}

// The most that a slab of one slice takes.
std::size_t most_output_bytes(const Slabs& s, const Pyramids& pyramids) {
    const InsideBits& bits = s.window.bits();
    std::size_t most = 0;
    for (std::int64_t z = 0; z < bits.nz; ++z)
        most = std::max(most, output_bytes(s, SlabOutput(bits, pyramids, z, z + 1)));
    return most;
}

// The end of the slab that begins at slice z: it has as many slices as fit in memory, and at least one.
std::int64_t slab_end(const Slabs& s, const Pyramids& pyramids, std::int64_t z) {
    const InsideBits& bits = s.window.bits();
    const auto bytes_until = [&](std::int64_t end) {
        return s.memory.window_bytes(end - z) + output_bytes(s, SlabOutput(bits, pyramids, z, end));
    };
    std::int64_t end = z + 1;
    while (end < bits.nz && end - z < s.most_slices && bytes_until(end + 1) <= s.memory.of_slab()) ++end;
    return end;
}

// The whole surface's arrays, of which only the current slab's part takes memory.
struct SurfaceMemory {
    SurfaceMemory(const Pyramids& pyramids, bool with_normals, bool huge_pages)
        : points(pyramids.points.total()),
          normals(with_normals ? pyramids.points.total() : 0),
          triangles(pyramids.triangles.total()) {
        points.use_huge_pages(huge_pages);
        normals.use_huge_pages(huge_pages);
        triangles.use_huge_pages(huge_pages);
    }

    SparseArray<Vec3f> points, normals;
    SparseArray<Triangle> triangles;
};

// Makes a slab's part of the surface, in 2 * share_count() steps of `stage` at most.
void emit(const EmitInput& input, const SlabOutput& slab, bool normals, SurfaceMemory& memory, Stage& stage) {
    Vec3f* const normal_memory = normals ? memory.normals.data() : nullptr;
    for_each_share(input.points, slab.row_begin, slab.points_row_end, [&](std::size_t from, std::size_t to) {
        emit_points(input, from, to, memory.points.data(), normal_memory);
        stage.step();
    });
    for_each_share(input.triangles, slab.row_begin, slab.row_end, [&](std::size_t from, std::size_t to) {
        emit_triangles(input, from, to, memory.triangles.data());
        stage.step();
    });
}

// Gives a slab's part of the surface to the sink, and then its memory back.
void hand_over(const SlabOutput& slab, bool normals, SurfaceMemory& memory, const SurfaceSink& sink) {
    const std::uint64_t points = slab.points(), triangles = slab.triangles();
    SurfacePart part{slab.point_begin,
                     {memory.points.data() + slab.point_begin, points},
                     {},
                     slab.triangle_begin,
                     {memory.triangles.data() + slab.triangle_begin, triangles},
                     slab.next_point_begin - slab.point_begin};
    if (normals) part.normals = {memory.normals.data() + slab.point_begin, points};
    sink.part(part);
    memory.points.release(slab.point_begin, slab.point_end);
    if (normals) memory.normals.release(slab.point_begin, slab.point_end);
    memory.triangles.release(slab.triangle_begin, slab.triangle_end);
}

// Reads the volume again, and makes the surface slab by slab.
void emit(Slabs& s, const Pyramids& pyramids, const SurfaceSink& sink, const Progress& progress) {
    Window& window = s.window;
    const InsideBits& bits = window.bits();
    const bool normals = s.options.normals;
    SurfaceMemory memory(pyramids, normals, s.memory.huge_pages());
    const EmitInput input{window.volume(),    s.isovalue,
                          s.to_physical,      bits,
                          s.active,           pyramids.points,
                          pyramids.triangles, s.rows.along_x,
                          s.rows.along_y,     s.ambiguous ? &*s.ambiguous : nullptr};
    window.rewind();
    for (std::int64_t z = 0; z < bits.nz;) {
        const std::int64_t end = slab_end(s, pyramids, z);
        const SlabOutput slab(bits, pyramids, z, end);
        const Progress of_slab = s.slab_progress(progress, z, end);
        window.advance(end + 2, 2, sub_progress(of_slab, 0, 0.4));
        const std::int64_t points_end = s.ambiguous ? std::min(end + 1, bits.nz) : z;
        const auto for_slices_with_points = [&](const auto& f) { parallel_for(z, points_end, f); };
        Stage stage(of_slab, 0.4, 0.9, static_cast<std::size_t>(points_end - z) + 2 * share_count());
        for_slices_with_points([&](std::int64_t slice) {
            if (!s.ambiguous->find_again(slice, s.active)) throw_samples_changed();
            stage.step();
        });
        emit(input, slab, normals, memory, stage);
        for_slices_with_points([&](std::int64_t slice) { s.ambiguous->forget(slice); });
        hand_over(slab, normals, memory, sink);
        window.release(end, 1);
        z = end;
        report_progress(of_slab, 1);
    }
}

void check(const SliceSource& source, const SurfaceSink& sink, const SlabLimits& limits,
           const IsosurfaceOptions& options) {
    check_geometry(source.geometry);
    check_rescale(source.rescale);
    if (!source.read || !sink.begin || !sink.part)
        throw InputError("extraction in slabs: a function of the source or the sink is missing");
    if (source.slices_at_once < 1) throw InputError("extraction in slabs: slices_at_once must be at least 1");
    if (limits.slices && *limits.slices < 1) throw InputError("a slab must have at least one slice");
    if (options.snap != 0)
        throw InputError("extraction in slabs cannot snap, since it never has all of the surface");
}

}  // namespace

void extract_isosurface_in_slabs(const SliceSource& source, double isovalue, const SurfaceSink& sink,
                                 const SlabLimits& limits, const IsosurfaceOptions& options,
                                 IsosurfaceStats* stats) {
    check(source, sink, limits, options);
    const double sample_isovalue = checked_isovalue(isovalue, source.rescale);
    if (stats != nullptr) *stats = {};
    if (!has_cells(source.geometry, options.closed)) return sink.begin(0, 0, options.normals);

    try {
        with_threads(options.threads, [&] {
            Slabs slabs(source, sample_isovalue, sink, limits, options);
            const Pyramids pyramids = count(slabs, sub_progress(options.progress, 0, 0.4));
            if (stats != nullptr) stats->non_finite_samples = slabs.window.non_finite_samples();
            check_point_count(pyramids.points.total());
            slabs.memory.divide(most_output_bytes(slabs, pyramids));
            slabs.window.use_huge_pages(slabs.memory.huge_pages());
            sink.begin(pyramids.points.total(), pyramids.triangles.total(), options.normals);
            emit(slabs, pyramids, sink, sub_progress(options.progress, 0.4, 1));
        });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(source.geometry);
    }
}

}  // namespace marrow
