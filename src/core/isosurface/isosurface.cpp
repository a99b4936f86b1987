// The passes of the extraction in order: classify, count, sum, emit.
#include <marrow/isosurface.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "base/resize_discarding.h"
#include "core/grid/shares.h"
#include "core/marching_cubes/ambiguous_cells.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/count.h"
#include "core/marching_cubes/emit.h"
#include "core/snap/snap.h"
#include "core/volume/check_options.h"
#include "core/volume/checks.h"
#include "core/volume/rows.h"

namespace marrow {

using namespace internal;

namespace {

using Clock = std::chrono::steady_clock;

void check_level(int level) {
    if (level < 0 || level > 30) throw InputError("the preview level must be between 0 and 30");
}

void check(const VolumeView& volume, const IsosurfaceOptions& options) {
    check_options(options);
    check_volume(volume);
}

// All data of an extraction except the mesh. An IsosurfaceExtractor keeps it, and with it the bits and ranges
// that the next isovalue need not compute again. Isovalues are those of samples.
struct Extraction {
    Extraction(const VolumeView& view, const IsosurfaceOptions& extraction_options, bool keep_ranges)
        : volume(view),
          options(extraction_options),
          to_physical(view),
          bits(view.geometry.dims, ClosedSides::all(extraction_options.closed)),
          active(bits),
          rows(bits.rows()) {
        if (keep_ranges) ranges.emplace(view.geometry.dims);
    }

    const VolumeView volume;
    const IsosurfaceOptions& options;
    const IndexToPhysical to_physical;
    InsideBits bits;
    ActiveWords active;
    RowCounts rows;
    std::optional<BlockRanges> ranges;
    std::optional<double> classified_for;  // the isovalue that bits and ranges belong to
    std::int64_t non_finite_samples = 0;

    std::size_t slices() const { return static_cast<std::size_t>(bits.nz); }
};

void classify(Extraction& e, double isovalue) {
    Stage stage(e.options.progress, 0, 0.3, e.slices());
    BlockRanges* ranges = e.ranges ? &*e.ranges : nullptr;
    if (const auto from = std::exchange(e.classified_for, std::nullopt)) {
        parallel_for(std::int64_t{0}, e.bits.nz, [&](std::int64_t z) {
            reclassify_slice(e.volume, *from, isovalue, z, e.bits, *ranges);
            stage.step();
        });
    } else {
        std::atomic<std::int64_t> non_finite = 0;
        parallel_for(std::int64_t{0}, e.bits.nz, [&](std::int64_t z) {
            non_finite += classify_slice(e.volume, isovalue, z, e.bits, ranges);
            stage.step();
        });
        e.non_finite_samples = non_finite;
    }
    if (ranges != nullptr) e.classified_for = isovalue;
}

// The histogram pyramids over rows.
struct Pyramids {
    HistoPyramid points, triangles;
};

// `ambiguous` is null without exact topology.
Pyramids count(Extraction& e, AmbiguousCells* ambiguous) {
    // If the previous extraction was cancelled, its pyramids took these arrays with them.
    e.rows.points.resize(e.bits.rows());
    e.rows.triangles.resize(e.bits.rows());
    Stage stage(e.options.progress, 0.3, 0.4, e.slices());
    const auto for_each_slice = [&](const auto& f) {
        parallel_for(std::int64_t{0}, e.bits.nz,
                     [&](std::int64_t z) { f(z, e.bits.row_index(0, z), e.bits.row_index(0, z + 1)); });
    };
    for_each_slice([&](std::int64_t z, std::size_t row_begin, std::size_t row_end) {
        if (ambiguous != nullptr)
            ambiguous->count(z, e.rows, e.active);
        else
            count_rows(e.bits, row_begin, row_end, e.rows, e.active);
        stage.step();
    });
    for_each_slice([&](std::int64_t, std::size_t row_begin, std::size_t row_end) {
        count_triangles(e.bits, row_begin, row_end, e.rows);
    });
    if (ambiguous != nullptr) {
        for (std::int64_t z = 0; z < e.bits.nz; ++z) ambiguous->add_to(e.rows, z);
    }
    return {HistoPyramid(std::move(e.rows.points)), HistoPyramid(std::move(e.rows.triangles))};
}

void allocate(const Pyramids& pyramids, bool normals, Mesh& mesh) {
    const std::uint64_t points = pyramids.points.total(), triangles = pyramids.triangles.total();
    resize_discarding(mesh.points, points);
    resize_discarding(mesh.normals, normals ? points : 0);
    resize_discarding(mesh.triangles, triangles);
}

// Makes the mesh. Returns the bytes of memory that this took in addition to the mesh.
std::size_t emit(const Extraction& e, const Pyramids& pyramids, double isovalue,
                 const AmbiguousCells* ambiguous, Mesh& mesh) {
    const EmitInput input{e.volume,        isovalue,           e.to_physical,  e.bits,         e.active,
                          pyramids.points, pyramids.triangles, e.rows.along_x, e.rows.along_y, ambiguous};
    if (e.options.snap > 0) {
        const Progress progress = sub_progress(e.options.progress, 0.4, 1);
        return snap(input, e.options.snap, e.options.normals, progress, mesh);
    }
    allocate(pyramids, e.options.normals, mesh);
    Stage stage(e.options.progress, 0.4, 1, 2 * share_count());
    Vec3f* normals = e.options.normals ? mesh.normals.data() : nullptr;
    for_each_share(input.points, 0, e.bits.rows(), [&](std::size_t row_begin, std::size_t row_end) {
        emit_points(input, row_begin, row_end, mesh.points.data(), normals);
        stage.step();
    });
    for_each_share(input.triangles, 0, e.bits.rows(), [&](std::size_t row_begin, std::size_t row_end) {
        emit_triangles(input, row_begin, row_end, mesh.triangles.data());
        stage.step();
    });
    report_progress(e.options.progress, 1);
    return 0;
}

// Extracts one surface, and measures the time of each pass.
void extract(Extraction& e, double isovalue, Mesh& mesh, IsosurfaceStats* stats) {
    const auto start = Clock::now();
    classify(e, isovalue);
    const auto classified = Clock::now();
    std::optional<AmbiguousCells> ambiguous;
    if (e.options.topology) ambiguous.emplace(e.volume, isovalue, e.to_physical, e.bits);
    AmbiguousCells* const cells = ambiguous ? &*ambiguous : nullptr;
    Pyramids pyramids = count(e, cells);
    const auto counted = Clock::now();
    const std::uint64_t points = pyramids.points.total(), triangles = pyramids.triangles.total();
    check_point_count(points);
    std::size_t snapping = 0;
    try {
        snapping = emit(e, pyramids, isovalue, cells, mesh);
    } catch (const std::bad_alloc&) {
        throw LimitError("there is not enough memory for " + std::to_string(points) + " points and " +
                         std::to_string(triangles) + " triangles; crop or coarsen the volume");
    }
    const auto emitted = Clock::now();
    const std::size_t scratch = e.bits.bytes() + e.active.bytes() + pyramids.points.bytes() +
                                pyramids.triangles.bytes() + 2 * e.bits.rows() * sizeof(std::uint32_t) +
                                (cells ? cells->bytes() : 0) + (e.ranges ? e.ranges->bytes() : 0) + snapping;
    e.rows.points = pyramids.points.release_leaves();
    e.rows.triangles = pyramids.triangles.release_leaves();
    if (stats == nullptr) return;
    const auto seconds = [](Clock::time_point from, Clock::time_point to) {
        return std::chrono::duration<double>(to - from).count();
    };
    *stats = {e.non_finite_samples, static_cast<std::int64_t>(scratch), seconds(start, classified),
              seconds(classified, counted), seconds(counted, emitted)};
}

// Every `step`-th sample along each axis.
Volume subsampled(const VolumeView& volume, std::int64_t step) {
    const auto& dims = volume.geometry.dims;
    Geometry geometry = volume.own_geometry();
    for (std::size_t a = 0; a < 3; ++a) {
        geometry.dims[a] = (dims[a] + step - 1) / step;
        geometry.spacing[a] *= static_cast<double>(step);
    }
    Volume result(geometry, volume.type);
    visit_sample_type(volume.type, [&](auto sample) {
        using T = decltype(sample);
        const auto [nx, ny, nz] = geometry.dims;
        parallel_for(std::int64_t{0}, nz, [&, nx = nx, ny = ny](std::int64_t z) {
            for (std::int64_t y = 0; y < ny; ++y) {
                const T* from = row_of<T>(volume, y * step, z * step);
                T* to = result.samples<T>() + (z * ny + y) * nx;
                for (std::int64_t x = 0; x < nx; ++x) to[x] = from[x * step];
            }
        });
    });
    return result;
}

// Runs `work` on `threads` threads. Memory can run out in any pass: that is a LimitError.
template <class Work>
void run(const VolumeView& volume, int threads, const Work& work) {
    try {
        with_threads(threads, work);
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(volume.geometry);
    }
}

}  // namespace

Mesh extract_isosurface(const VolumeView& volume, double isovalue, const IsosurfaceOptions& options,
                        IsosurfaceStats* stats) {
    check(volume, options);
    const double sample_isovalue = checked_isovalue(isovalue, volume.rescale);
    Mesh mesh;
    if (stats != nullptr) *stats = {};
    if (!has_cells(volume.geometry, options.closed)) return mesh;
    run(volume, options.threads, [&] {
        Extraction extraction(volume, options, false);
        extract(extraction, sample_isovalue, mesh, stats);
    });
    return mesh;
}

struct IsosurfaceExtractor::Impl {
    // The extraction from every 2^level-th sample.
    struct Level {
        Level(const VolumeView& samples, const IsosurfaceOptions& options)
            : extraction(samples, options, true) {}
        Level(Volume&& samples, const IsosurfaceOptions& options)
            : owned(std::move(samples)), extraction(owned, options, true) {}

        Volume owned;  // empty for level 0, which borrows its samples
        Extraction extraction;
    };

    IsosurfaceOptions options;  // the levels refer to it
    std::vector<std::unique_ptr<Level>> levels;
    std::map<int, Mesh> meshes;  // of the levels that were extracted without a mesh of the caller
};

IsosurfaceExtractor::IsosurfaceExtractor(const VolumeView& volume, const IsosurfaceOptions& options)
    : impl_(std::make_unique<Impl>()) {
    check(volume, options);
    impl_->options = options;
    run(volume, options.threads,
        [&] { impl_->levels.push_back(std::make_unique<Impl::Level>(volume, impl_->options)); });
}

IsosurfaceExtractor::~IsosurfaceExtractor() = default;
IsosurfaceExtractor::IsosurfaceExtractor(IsosurfaceExtractor&&) noexcept = default;
IsosurfaceExtractor& IsosurfaceExtractor::operator=(IsosurfaceExtractor&&) noexcept = default;

void IsosurfaceExtractor::extract(double isovalue, Mesh& mesh, int level, IsosurfaceStats* stats) {
    const double sample_isovalue = checked_isovalue(isovalue, impl_->levels[0]->extraction.volume.rescale);
    check_level(level);
    const auto index = static_cast<std::size_t>(level);
    auto& levels = impl_->levels;
    if (index >= levels.size()) levels.resize(index + 1);
    if (stats != nullptr) *stats = {};
    resize_discarding(mesh.points, 0);
    resize_discarding(mesh.normals, 0);
    resize_discarding(mesh.triangles, 0);
    const VolumeView& volume = levels[0]->extraction.volume;
    run(volume, impl_->options.threads, [&] {
        if (!levels[index]) {
            levels[index] =
                std::make_unique<Impl::Level>(subsampled(volume, std::int64_t{1} << level), impl_->options);
        }
        Impl::Level& l = *levels[index];
        if (has_cells(l.extraction.volume.geometry, impl_->options.closed))
            marrow::extract(l.extraction, sample_isovalue, mesh, stats);
    });
}

const Mesh& IsosurfaceExtractor::extract(double isovalue, int level, IsosurfaceStats* stats) {
    check_level(level);
    Mesh& mesh = impl_->meshes[level];
    extract(isovalue, mesh, level, stats);
    return mesh;
}

}  // namespace marrow
