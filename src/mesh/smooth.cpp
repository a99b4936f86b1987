// Applies a low-pass filter to the points of a mesh, after Taubin, Zhang and Golub 1996.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include <marrow/error.h>
#include <marrow/smooth.h>

#include "base/parallel.h"
#include "base/progress.h"
#include "check_indices.h"
#include "find_components.h"
#include "half_edges.h"
#include "normals.h"

namespace marrow {

using namespace internal;

namespace {

// The neighbours of point p are points[start[p]] to points[start[p + 1] - 1]. A point on an open or
// non-manifold edge has none, so that the filter does not move it.
struct Neighbours {
    std::vector<std::size_t> start;
    std::vector<std::uint32_t> points;

    explicit Neighbours(const Mesh& mesh) : start(mesh.points.size() + 2, 0) {
        std::vector<bool> fixed(mesh.points.size(), false);
        std::vector<std::array<std::uint32_t, 2>> edges;
        edges.reserve(mesh.triangles.size() * 3 / 2);
        for_each_edge(mesh, [&](const Edge& e) {
            edges.push_back({e.lower, e.higher});
            if (!e.is_manifold()) fixed[e.lower] = fixed[e.higher] = true;
        });
        const auto for_each = [&](auto&& f) {
            for (const auto& [a, b] : edges) {
                if (!fixed[a]) f(a, b);
                if (!fixed[b]) f(b, a);
            }
        };
        // Counts go two entries further, so that filling leaves the first neighbour of p in start[p].
        for_each([&](std::uint32_t p, std::uint32_t) { ++start[p + std::size_t{2}]; });
        std::partial_sum(start.begin(), start.end(), start.begin());
        points.resize(start.back());
        for_each([&](std::uint32_t p, std::uint32_t q) { points[start[p + std::size_t{1}]++] = q; });
    }
};

// Returns the Chebyshev coefficients of a low-pass filter: the ideal filter that cuts at the angle `cut`, 0
// to pi, times a Hamming window. They are scaled so that the filter leaves a constant unchanged.
std::vector<double> low_pass(int degree, double cut) {
    using std::numbers::pi;
    std::vector<double> c(static_cast<std::size_t>(degree) + 1);
    double sum = 0;
    for (int n = 0; n <= degree; ++n) {
        const double window = 0.54 + 0.46 * std::cos(n * pi / (degree + 1));
        c[static_cast<std::size_t>(n)] = window * (n == 0 ? cut / pi : 2 * std::sin(n * cut) / (n * pi));
        sum += c[static_cast<std::size_t>(n)];
    }
    for (double& value : c) value /= sum;
    return c;
}

double response(const std::vector<double>& c, double angle) {
    double sum = 0;
    for (std::size_t n = 0; n < c.size(); ++n) sum += c[n] * std::cos(static_cast<double>(n) * angle);
    return sum;
}

// Returns the filter whose response is still almost 1 at the end of the pass band. The response of a short
// filter falls slowly, so a short filter must cut later.
std::vector<double> low_pass_for(int degree, double pass_band) {
    constexpr double kPasses = 0.995;
    const double end = std::acos(1 - pass_band / 2);
    double low = end, high = std::numbers::pi / 2;
    for (int step = 0; step < 40; ++step) {
        const double cut = (low + high) / 2;
        (response(low_pass(degree, cut), end) < kPasses ? low : high) = cut;
    }
    return low_pass(degree, high);
}

// Limits the move of a point to half a sample along each index axis.
class Bound {
  public:
    explicit Bound(const Mat3d& index_to_physical) : to_physical_(index_to_physical) {
        if (!(std::abs(determinant(to_physical_)) > 0))
            throw InputError("smooth: the matrix of the bound is singular");
        to_index_ = inverse(to_physical_);
    }

    Vec3d operator()(const Vec3d& from, const Vec3d& to) const {
        Vec3d steps = to_index_ * (to - from);
        for (double& step : steps) step = std::clamp(step, -0.5, 0.5);
        return from + to_physical_ * steps;
    }

  private:
    const Mat3d to_physical_;
    Mat3d to_index_{};
};

// Moves every point by the filter. y_i = T_i(A) x with the Chebyshev polynomials T_i, where A averages a
// point with the mean of its neighbours. The result is the sum of c_i y_i.
class Filter {
  public:
    Filter(const Mesh& mesh, const Neighbours& neighbours)
        : neighbours_(neighbours),
          previous_(mesh.points.size()),
          y_(mesh.points.size()),
          next_(mesh.points.size()),
          sum_(mesh.points.size()) {
        for_each_point([&](std::size_t p) { y_[p] = to_double(mesh.points[p]); });
    }

    // \throw Cancelled
    const std::vector<Vec3d>& apply(const std::vector<double>& c, const Progress& progress) {
        for_each_point([&](std::size_t p) { sum_[p] = c[0] * y_[p]; });
        for (std::size_t i = 1; i < c.size(); ++i) {
            report_progress(progress, static_cast<double>(i) / static_cast<double>(c.size()));
            for_each_point([&](std::size_t p) {
                next_[p] = i == 1 ? 0.5 * twice_average(p) : twice_average(p) - previous_[p];
                sum_[p] = sum_[p] + c[i] * next_[p];
            });
            previous_.swap(y_);
            y_.swap(next_);
        }
        return sum_;
    }

  private:
    template <class F>
    void for_each_point(const F& f) const {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, y_.size(), 4096), [&](const auto& range) {
            for (std::size_t p = range.begin(); p < range.end(); ++p) f(p);
        });
    }
    Vec3d twice_average(std::size_t p) const {
        const std::size_t begin = neighbours_.start[p], end = neighbours_.start[p + 1];
        if (begin == end) return 2 * y_[p];
        Vec3d sum{};
        for (std::size_t i = begin; i < end; ++i) sum = sum + y_[neighbours_.points[i]];
        return y_[p] + (1 / static_cast<double>(end - begin)) * sum;
    }

    const Neighbours& neighbours_;
    std::vector<Vec3d> previous_, y_, next_, sum_;
};

// Moves the points of components that the filter has nearly flattened back. These are specks of a few
// triangles, whose shape consists of frequencies above the pass band. Returns their number.
std::int64_t restore_flattened(const Mesh& before, Mesh& mesh) {
    const Components old = find_components(before), now = find_components(mesh);
    std::vector<bool> restore(old.all.size(), false);
    for (std::size_t c = 0; c < old.all.size(); ++c) {
        const double volume = old.all[c].volume;
        restore[c] = old.all[c].closed && std::abs(now.all[c].volume - volume) > std::abs(volume) / 2;
    }
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        const std::uint32_t component = old.of_point[p];
        if (component != Components::kNone && restore[component]) mesh.points[p] = before.points[p];
    }
    return std::count(restore.begin(), restore.end(), true);
}

Mesh smoothed(const Mesh& mesh, const SmoothOptions& options, SmoothStats& stats) {
    const std::optional<Bound> bound = options.bound ? std::optional<Bound>(*options.bound) : std::nullopt;
    const Neighbours neighbours(mesh);
    Filter filter(mesh, neighbours);
    const std::vector<Vec3d>& filtered =
        filter.apply(low_pass_for(options.iterations, options.pass_band), options.progress);

    Mesh result;
    result.triangles = mesh.triangles;
    result.points.resize(mesh.points.size());
    tbb::parallel_for(std::size_t{0}, mesh.points.size(), [&](std::size_t p) {
        if (neighbours.start[p] == neighbours.start[p + 1])
            result.points[p] = mesh.points[p];
        else
            result.points[p] =
                to_float(bound ? (*bound)(to_double(mesh.points[p]), filtered[p]) : filtered[p]);
    });
    stats.restored_components = restore_flattened(mesh, result);
    if (!mesh.normals.empty()) result.normals = point_normals(result);
    return result;
}

}  // namespace

Mesh smooth(const Mesh& mesh, const SmoothOptions& options, SmoothStats* stats) {
    if (options.iterations < 0) throw InputError("smooth: the number of iterations must not be negative");
    if (!(options.pass_band > 0 && options.pass_band < 2))
        throw InputError("smooth: the pass band must be above 0 and below 2");
    check_indices(mesh);
    if (options.iterations == 0) return mesh;
    Mesh result;
    SmoothStats found;
    with_threads(options.threads, [&] { result = smoothed(mesh, options, found); });
    if (stats) *stats = found;
    return result;
}

}  // namespace marrow
