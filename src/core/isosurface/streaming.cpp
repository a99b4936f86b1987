#include <marrow/streaming.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <optional>

#include "base/parallel.h"
#include "core/grid/shares.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/count.h"
#include "core/marching_cubes/emit.h"
#include "core/volume/checks.h"
#include "core/volume/sparse_array.h"

namespace marrow {

using namespace internal;

namespace {

// The volume's samples and inside bits, of which a window of slices is in memory. Slices are numbered as in the grid.
class Window {
  public:
    Window(const SliceSource& source, double isovalue, bool closed)
        : source_(source),
          isovalue_(isovalue),
          slice_samples_(static_cast<std::size_t>(source.geometry.dims[0] * source.geometry.dims[1])),
          slice_bytes_(slice_samples_ * sample_size(source.type)),
          samples_(slice_bytes_ * static_cast<std::size_t>(source.geometry.dims[2])),
          bit_memory_(InsideBits(source.geometry.dims, closed, nullptr).word_count() + InsideBits::kSlack),
          bits_(source.geometry.dims, closed, bit_memory_.data()) {
        volume_.geometry = source.geometry;
        volume_.type = source.type;
        volume_.data = samples_.data();
    }

    const VolumeView& volume() const { return volume_; }
    const InsideBits& bits() const { return bits_; }
    std::int64_t non_finite_samples() const { return non_finite_; }
    // Memory of a slice and its bits.
    std::size_t bytes_per_slice() const {
        return slice_bytes_ + bits_.row_index(0, 1) * bits_.words_per_row * 8;
    }

    // Begins again from the first slice.
    void rewind() {
        release(bits_.nz);
        read_ = classified_ = released_ = released_bits_ = 0;
        non_finite_ = 0;
    }

    // Has the samples and bits of all slices before `end`, but those released, and the samples of `ahead` slices more.
    void advance(std::int64_t end, std::int64_t ahead) {
        const std::int64_t nz = source_.geometry.dims[2];
        const std::int64_t samples_end = std::clamp<std::int64_t>(end - bits_.pad + ahead, read_, nz);
        if (samples_end > read_) {
            source_.read(read_, samples_end,
                         samples_.data() + slice_bytes_ * static_cast<std::size_t>(read_));
            read_ = samples_end;
        }
        const std::int64_t bits_end = std::min(end, bits_.nz);
        std::atomic<std::int64_t> non_finite = 0;
        tbb::parallel_for(classified_, std::max(classified_, bits_end), [&](std::int64_t z) {
            non_finite += classify_slice(volume_, isovalue_, z, bits_, nullptr);
        });
        non_finite_ += non_finite;
        classified_ = std::max(classified_, bits_end);
    }

    // Gives back the bits of slices before `end`, and the samples but those of `behind` slices before it.
    void release(std::int64_t end, std::int64_t behind = 0) {
        const std::int64_t samples_end = std::clamp<std::int64_t>(end - bits_.pad - behind, released_, read_);
        samples_.release(slice_bytes_ * static_cast<std::size_t>(released_),
                         slice_bytes_ * static_cast<std::size_t>(samples_end));
        released_ = samples_end;
        const std::int64_t bits_end = std::clamp<std::int64_t>(end, released_bits_, classified_);
        const std::size_t words = bits_.row_index(0, 1) * bits_.words_per_row;
        bit_memory_.release(words * static_cast<std::size_t>(released_bits_),
                            words * static_cast<std::size_t>(bits_end));
        released_bits_ = bits_end;
    }

  private:
    const SliceSource& source_;
    const double isovalue_;
    const std::size_t slice_samples_, slice_bytes_;
    SparseArray<std::byte> samples_;
    SparseArray<std::uint64_t> bit_memory_;
    InsideBits bits_;
    VolumeView volume_;
    std::int64_t read_ = 0, released_ = 0;  // slices of the volume
    std::int64_t classified_ = 0, released_bits_ = 0;
    std::int64_t non_finite_ = 0;
};

// First reading: what every row makes.
void count(Window& window, std::int64_t slices, RowCounts& rows, ActiveWords& active,
           const Progress& progress) {
    const InsideBits& bits = window.bits();
    for (std::int64_t z = 0; z < bits.nz; z += slices) {
        const std::int64_t end = std::min(z + slices, bits.nz);
        window.advance(end + 1, 0);
        tbb::parallel_for(z, end, [&](std::int64_t slice) {
            count_rows(bits, bits.row_index(0, slice), bits.row_index(0, slice + 1), rows, active);
        });
        // The next slab begins with bits that are there already; no sample is needed again.
        window.release(end, -1);
        report_progress(progress, 0.4 * static_cast<double>(end) / static_cast<double>(bits.nz));
    }
    tbb::parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t slice) {
        count_triangles(bits, bits.row_index(0, slice), bits.row_index(0, slice + 1), rows);
    });
}

void check(const SliceSource& source, const SurfaceSink& sink, const SlabLimits& limits) {
    check_geometry(source.geometry);
    if (!source.read || !sink.begin || !sink.part)
        throw InputError(
            "a surface in slabs needs a function that reads slices, and two that take the surface");
    if (limits.slices && *limits.slices < 1) throw InputError("a slab needs at least one slice");
}

}  // namespace

void extract_isosurface_in_slabs(const SliceSource& source, double isovalue, const SurfaceSink& sink,
                                 const SlabLimits& limits, const IsosurfaceOptions& options,
                                 IsosurfaceStats* stats) {
    check(source, sink, limits);
    check_isovalue(isovalue);
    if (options.snap != 0)
        throw InputError(
            "a surface that is extracted in slabs cannot be snapped: it is never there as a whole");
    if (stats != nullptr) *stats = {};
    if (!has_cells(source.geometry, options.closed)) return sink.begin(0, 0, options.normals);

    with_threads(options.threads, [&] {
        Window window(source, isovalue, options.closed);
        const InsideBits& bits = window.bits();
        RowCounts rows(bits.rows());
        ActiveWords active(bits);

        // Stencils reach one slice back and two ahead, and the part's last slice of points is made with it: 5 more.
        constexpr std::int64_t kHalo = 5;
        const std::size_t counts = 18 * bits.rows() + active.bytes();
        const std::size_t least = counts + (kHalo + 1) * window.bytes_per_slice();
        if (limits.memory < least) {
            throw LimitError("this volume cannot be worked on in less than " +
                             std::to_string((least >> 20) + 1) + " MiB");
        }
        const std::size_t for_slabs = limits.memory - counts;
        const std::int64_t most = limits.slices.value_or(bits.nz);
        const auto fit = static_cast<std::int64_t>(for_slabs / window.bytes_per_slice()) - kHalo;
        count(window, std::min(most, std::max<std::int64_t>(fit, 1)), rows, active, options.progress);

        const HistoPyramid points(std::move(rows.points)), triangles(std::move(rows.triangles));
        check_point_count(points.total());
        sink.begin(points.total(), triangles.total(), options.normals);

        SparseArray<Vec3f> point_memory(points.total()), normal_memory(options.normals ? points.total() : 0);
        SparseArray<Triangle> triangle_memory(triangles.total());
        const IndexToPhysical to_physical(source.geometry);
        const EmitInput input{window.volume(), isovalue,  to_physical,  bits,        active,
                              points,          triangles, rows.along_x, rows.along_y};
        const std::size_t point_bytes = sizeof(Vec3f) * (options.normals ? 2 : 1);
        const auto slice_row = [&](std::int64_t z) { return bits.row_index(0, std::min(z, bits.nz)); };

        window.rewind();
        for (std::int64_t z = 0; z < bits.nz;) {
            // As many slices as memory takes, now that their output is known.
            std::int64_t end = z;
            const auto bytes_until = [&](std::int64_t slab_end) {
                const std::uint64_t slab_points =
                    points.first_output(slice_row(slab_end + 1)) - points.first_output(slice_row(z));
                const std::uint64_t slab_triangles =
                    triangles.first_output(slice_row(slab_end)) - triangles.first_output(slice_row(z));
                return static_cast<std::size_t>(slab_end - z + kHalo) * window.bytes_per_slice() +
                       slab_points * point_bytes + slab_triangles * sizeof(Triangle);
            };
            do ++end;
            while (end < bits.nz && end - z < most && bytes_until(end + 1) <= for_slabs);

            window.advance(end + 2, 2);
            const std::size_t row_begin = slice_row(z), row_end = slice_row(end),
                              points_end = slice_row(end + 1);
            for_each_share(points, row_begin, points_end, [&](std::size_t from, std::size_t to) {
                emit_points(input, from, to, point_memory.data(),
                            options.normals ? normal_memory.data() : nullptr);
            });
            for_each_share(triangles, row_begin, row_end, [&](std::size_t from, std::size_t to) {
                emit_triangles(input, from, to, triangle_memory.data());
            });

            const std::uint64_t p0 = points.first_output(row_begin), p1 = points.first_output(points_end);
            const std::uint64_t t0 = triangles.first_output(row_begin), t1 = triangles.first_output(row_end);
            SurfacePart part{
                p0, {point_memory.data() + p0, p1 - p0}, {}, t0, {triangle_memory.data() + t0, t1 - t0}};
            if (options.normals) part.normals = {normal_memory.data() + p0, p1 - p0};
            sink.part(part);
            point_memory.release(p0, p1);
            if (options.normals) normal_memory.release(p0, p1);
            triangle_memory.release(t0, t1);
            window.release(end, 1);
            z = end;
            report_progress(options.progress,
                            0.4 + 0.6 * static_cast<double>(end) / static_cast<double>(bits.nz));
        }
        if (stats != nullptr) stats->non_finite_samples = window.non_finite_samples();
    });
}

}  // namespace marrow
