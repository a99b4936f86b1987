// Smooths in three steps: a low-pass filter moves the points, components that it has nearly flattened go
// back, and points go back part of their way where the surface would pass through itself.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <marrow/error.h>
#include <marrow/smooth.h>

#include "base/all_finite.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "component_volumes.h"
#include "hold_back.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/connectivity/connected_points.h"
#include "mesh/connectivity/one_rings.h"
#include "mesh/geometry/normals.h"
#include "smooth_filter.h"

namespace marrow {

using namespace internal;

namespace {

// Limits the move of a point to half a sample along each index axis.
class Bound {
  public:
    explicit Bound(const Mat3d& index_to_physical)
        : to_physical_(index_to_physical), to_index_(inverse(index_to_physical)) {}

    Vec3d limited(const Vec3d& move) const {
        Vec3d steps = to_index_ * move;
        for (double& step : steps) step = std::clamp(step, -0.5, 0.5);
        return to_physical_ * steps;
    }

  private:
    const Mat3d to_physical_, to_index_;
};

// Moves the points of closed components that the filter has nearly flattened back. These are specks of a few
// triangles, whose shape consists of frequencies above the pass band. Returns their number. `lowest` has the
// lowest point of each point's component.
std::int64_t restore_flattened(const Mesh& before, const OneRings& rings, const Buffer<std::uint32_t>& lowest,
                               Mesh& mesh) {
    std::vector<std::uint32_t> flattened;
    for (const ComponentVolumes& v : component_volumes(before, mesh.points, lowest)) {
        if (std::abs(v.after - v.before) > std::abs(v.before) / 2) flattened.push_back(v.lowest);
    }
    if (flattened.empty()) return 0;
    std::vector<bool> restore(lowest.size(), false);
    for (const std::uint32_t p : flattened) restore[p] = true;
    // A component with an irregular edge is not closed.
    for (std::size_t p = 0; p < lowest.size(); ++p) {
        if (!rings.is_regular(p)) restore[lowest[p]] = false;
    }
    for (std::size_t p = 0; p < lowest.size(); ++p) {
        if (restore[lowest[p]]) mesh.points[p] = before.points[p];
    }
    return std::count(restore.begin(), restore.end(), true);
}

void measure_moves(const Mesh& before, const Mesh& after, SmoothStats& stats) {
    struct Moves {
        double sum = 0, max = 0;
    };
    // Deterministic: the sums do not depend on the threads.
    const Moves moves = parallel_reduce(
        std::size_t{0}, before.points.size(), 8192, Moves{},
        [&](const auto& range, Moves m) {
            // In groups, as roots of several numbers take no longer than of one.
            std::array<double, 16> moved;
            for (std::size_t p = range.begin(); p < range.end();) {
                const std::size_t count = std::min(moved.size(), range.end() - p);
                for (std::size_t i = 0; i < count; ++i, ++p)
                    moved[i] = length(to_double(after.points[p]) - to_double(before.points[p]));
                for (std::size_t i = 0; i < count; ++i) m = {m.sum + moved[i], std::max(m.max, moved[i])};
            }
            return m;
        },
        [](const Moves& a, const Moves& b) {
            return Moves{a.sum + b.sum, std::max(a.max, b.max)};
        });
    stats.moved_max = moves.max;
    if (!before.points.empty()) stats.moved_mean = moves.sum / static_cast<double>(before.points.size());
}

Mesh smoothed(const Mesh& mesh, const SmoothOptions& options, SmoothStats& stats) {
    const std::optional<Bound> bound = options.bound ? std::optional<Bound>(*options.bound) : std::nullopt;
    const OneRings rings(mesh);
    Buffer<Displacement> displacements;
    Buffer<std::uint32_t> lowest;
    const Progress filtering = sub_progress(options.progress, 0, 0.5);
    parallel_invoke(
        [&] { displacements = low_pass(mesh, rings, options.iterations, options.pass_band, filtering); },
        [&] { lowest = lowest_connected_points(mesh); });
    Mesh result;
    result.triangles.resize(mesh.triangles.size());
    parallel_for_ranges(std::size_t{0}, mesh.triangles.size(), 65536, [&](const auto& range) {
        std::copy(mesh.triangles.data() + range.begin(), mesh.triangles.data() + range.end(),
                  result.triangles.data() + range.begin());
    });
    result.points.resize(mesh.points.size());
    parallel_for_ranges(std::size_t{0}, rings.size(), 4096, [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) {
            result.points[p] = mesh.points[p];
            if (!rings.is_regular(p)) continue;
            const float* const xyz = displacements[p].xyz;
            Vec3d move{xyz[0], xyz[1], xyz[2]};
            if (bound) move = bound->limited(move);
            if (options.max_move) {
                const double longest = *options.max_move, size = length(move);
                if (size > longest) move = (longest / size) * move;
            }
            const Vec3f moved = to_float(to_double(mesh.points[p]) + move);
            // Sums of large coordinates overflow.
            if (all_finite({&moved, 1})) result.points[p] = moved;
        }
    });
    displacements = {};
    stats.restored_components = restore_flattened(mesh, rings, lowest, result);
    const auto start = [&] { return std::span<const Vec3f>(mesh.points); };
    stats.held_back_points =
        static_cast<std::int64_t>(hold_back(result, rings, start, options.progress, 0.5, 1));
    measure_moves(mesh, result, stats);
    if (!mesh.normals.empty()) set_normals(result);
    return result;
}

}  // namespace

Mesh smooth(const Mesh& mesh, const SmoothOptions& options, SmoothStats* stats) {
    if (options.iterations < 0) throw InputError("smooth: the number of iterations must not be negative");
    if (!(options.pass_band > 0 && options.pass_band < 2))
        throw InputError("smooth: the pass band must be above 0 and below 2");
    if (options.max_move && !(*options.max_move >= 0))
        throw InputError("smooth: the largest move must be a number of mm from 0 upwards");
    if (options.bound && !(std::abs(determinant(*options.bound)) > 0))
        throw InputError("smooth: the matrix of the bound is singular");
    check_arrays(mesh);
    check_coordinates(mesh.points);
    check_triangle_count(mesh, "smooth");
    if (stats) *stats = {};
    if (options.iterations == 0) return mesh;
    Mesh result;
    SmoothStats found;
    with_threads(options.threads, [&] { result = smoothed(mesh, options, found); });
    if (stats) *stats = found;
    return result;
}

}  // namespace marrow
