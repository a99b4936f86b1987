#include <marrow/isosurface.h>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <new>
#include <string>

#include "classify.h"
#include "count.h"
#include "emit.h"

namespace marrow {

using namespace internal;

namespace {

using Clock = std::chrono::steady_clock;

// Each thread takes its work in this many shares, so that none waits long for the slowest.
constexpr std::size_t kSharesPerThread = 8;

// Reports one stage's part of the whole, from one thread at a time.
class Stage {
  public:
    Stage(const Progress& progress, double begin, double end, std::size_t steps)
        : progress_(progress),
          begin_(begin),
          per_step_((end - begin) / static_cast<double>(std::max<std::size_t>(steps, 1))) {}

    void step() {
        if (!progress_) return;
        const std::lock_guard lock(mutex_);
        report(progress_, begin_ + per_step_ * static_cast<double>(++done_));
    }

  private:
    const Progress& progress_;
    const double begin_, per_step_;
    std::size_t done_ = 0;
    std::mutex mutex_;
};

void check(const VolumeView& volume, double isovalue) {
    check_geometry(volume.geometry);
    if (!std::isfinite(isovalue)) throw InputError("isovalue is not a finite number");
    if (volume.data == nullptr && volume.geometry.sample_count() > 0)
        throw InputError("volume has no samples");
}

bool has_cells(const Geometry& geometry, bool closed) {
    const std::int64_t fewest = *std::min_element(geometry.dims.begin(), geometry.dims.end());
    return fewest >= (closed ? 1 : 2);
}

// oneTBB warns on stderr when asked for more threads than there are.
int thread_count(int wanted) {
    const auto most =
        static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    return wanted > 0 ? std::min(wanted, most) : most;
}

InsideBits classify(const VolumeView& volume, double isovalue, const IsosurfaceOptions& options,
                    IsosurfaceStats& stats) {
    InsideBits bits(volume.geometry.dims, options.closed);
    Stage stage(options.progress, 0, 0.3, static_cast<std::size_t>(bits.nz));
    std::atomic<std::int64_t> non_finite = 0;
    tbb::parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
        non_finite += classify_slice(volume, isovalue, z, bits, nullptr);
        stage.step();
    });
    stats.non_finite_samples = non_finite;
    return bits;
}

// The histogram pyramids of points and of triangles, over rows; and how many of a row's points lie along x
// and y.
struct Counts {
    HistoPyramid points, triangles;
    std::vector<std::uint32_t> along_x, along_y;

    std::int64_t bytes() const {
        return static_cast<std::int64_t>(points.bytes() + triangles.bytes() +
                                         (along_x.size() + along_y.size()) * sizeof(std::uint32_t));
    }
};

Counts count(const InsideBits& bits, const IsosurfaceOptions& options) {
    RowCounts rows(bits.rows());
    Stage stage(options.progress, 0.3, 0.4, static_cast<std::size_t>(bits.nz));
    tbb::parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
        count_rows(bits, bits.row_index(0, z), bits.row_index(0, z + 1), rows);
        stage.step();
    });
    tbb::parallel_for(std::int64_t{0}, bits.nz, [&](std::int64_t z) {
        count_triangles(bits, bits.row_index(0, z), bits.row_index(0, z + 1), rows);
    });
    return {HistoPyramid(std::move(rows.points)), HistoPyramid(std::move(rows.triangles)),
            std::move(rows.along_x), std::move(rows.along_y)};
}

Mesh allocate(const Counts& counts, bool normals) {
    const std::uint64_t points = counts.points.total(), triangles = counts.triangles.total();
    if (points > std::numeric_limits<std::uint32_t>::max()) {
        throw LimitError(
            "the surface has " + std::to_string(points) +
            " points, more than the 2^32 - 1 that triangles can name; crop or coarsen the volume");
    }
    Mesh mesh;
    try {
        mesh.points.resize(points);
        if (normals) mesh.normals.resize(points);
        mesh.triangles.resize(triangles);
    } catch (const std::exception&) {
        throw LimitError("no memory for " + std::to_string(points) + " points and " +
                         std::to_string(triangles) + " triangles");
    }
    return mesh;
}

// The first row whose whole output lies at or behind `key`: where a share of the output starts.
std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key) {
    if (key >= pyramid.total()) return pyramid.leaves().size();
    const auto [row, remainder] = pyramid.locate(key);
    return row + (remainder > 0 ? 1 : 0);
}

// Runs f(row_begin, row_end) over equal shares of a pyramid's output.
template <class F>
void for_each_share(const HistoPyramid& pyramid, std::size_t shares, Stage& stage, const F& f) {
    const std::uint64_t total = pyramid.total();
    if (total == 0) return;
    tbb::parallel_for(std::size_t{0}, shares, [&](std::size_t share) {
        const std::size_t row_begin = row_at(pyramid, total * share / shares);
        const std::size_t row_end = row_at(pyramid, total * (share + 1) / shares);
        if (row_begin < row_end) f(row_begin, row_end);
        stage.step();
    });
}

void emit(const EmitInput& input, const IsosurfaceOptions& options, Mesh& mesh) {
    const std::size_t shares =
        kSharesPerThread * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
    Stage stage(options.progress, 0.4, 1, 2 * shares);
    Vec3f* normals = options.normals ? mesh.normals.data() : nullptr;
    for_each_share(input.points, shares, stage, [&](std::size_t row_begin, std::size_t row_end) {
        emit_points(input, row_begin, row_end, mesh.points.data(), normals);
    });
    for_each_share(input.triangles, shares, stage, [&](std::size_t row_begin, std::size_t row_end) {
        emit_triangles(input, row_begin, row_end, mesh.triangles.data());
    });
}

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Mesh extract(const VolumeView& volume, double isovalue, const IsosurfaceOptions& options,
             IsosurfaceStats& stats) {
    const auto start = Clock::now();
    const InsideBits bits = classify(volume, isovalue, options, stats);
    const auto classified = Clock::now();
    const Counts counts = count(bits, options);
    const auto counted = Clock::now();
    Mesh mesh = allocate(counts, options.normals);
    const Frame frame(volume.geometry);
    emit({volume, isovalue, frame, bits, counts.points, counts.triangles, counts.along_x, counts.along_y},
         options, mesh);

    stats.classify_seconds = std::chrono::duration<double>(classified - start).count();
    stats.count_seconds = std::chrono::duration<double>(counted - classified).count();
    stats.emit_seconds = seconds_since(counted);
    stats.scratch_bytes =
        static_cast<std::int64_t>(bits.bytes() + counts.points.bytes() + counts.triangles.bytes());
    return mesh;
}

}  // namespace

Mesh extract_isosurface(const VolumeView& volume, double isovalue, const IsosurfaceOptions& options,
                        IsosurfaceStats* stats) {
    check(volume, isovalue);
    IsosurfaceStats unused;
    IsosurfaceStats& found = stats != nullptr ? *stats : unused;
    if (!has_cells(volume.geometry, options.closed)) return {};
    tbb::task_arena arena(thread_count(options.threads));
    return arena.execute([&] { return extract(volume, isovalue, options, found); });
}

}  // namespace marrow
