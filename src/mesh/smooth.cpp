// Smoothing as a low-pass filter on the mesh's points, after Taubin, Zhang and Golub 1996.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <marrow/error.h>
#include <marrow/smooth.h>

#include "base/progress.h"
#include "check_indices.h"
#include "half_edges.h"
#include "normals.h"
#include "shells.h"
#include "vector.h"

namespace marrow {

using namespace internal;

namespace {

// The points along the edges from each point: those of p are at [start[p], start[p + 1]). A point on an open
// or non-manifold edge has none, so that it stays.
struct Neighbours {
    std::vector<std::size_t> start;
    std::vector<std::uint32_t> points;

    explicit Neighbours(const Mesh& mesh) : start(mesh.points.size() + 2, 0) {
        std::vector<bool> stays(mesh.points.size(), false);
        std::vector<std::array<std::uint32_t, 2>> edges;
        edges.reserve(mesh.triangles.size() * 3 / 2);
        for_each_edge(mesh, [&](const Edge& e) {
            edges.push_back({e.lower, e.higher});
            if (!e.is_manifold()) stays[e.lower] = stays[e.higher] = true;
        });
        const auto for_each = [&](auto&& f) {
            for (const auto& [a, b] : edges) {
                if (!stays[a]) f(a, b);
                if (!stays[b]) f(b, a);
            }
        };
        // Counted two slots on, so that filling leaves start[p] at the begin of p's neighbours.
        for_each([&](std::uint32_t p, std::uint32_t) { ++start[p + std::size_t{2}]; });
        std::partial_sum(start.begin(), start.end(), start.begin());
        points.resize(start.back());
        for_each([&](std::uint32_t p, std::uint32_t q) { points[start[p + std::size_t{1}]++] = q; });
    }
};

// The Chebyshev coefficients of a low-pass filter: the ideal one that cuts at angle `cut`, 0 to pi, through a
// Hamming window; scaled so that a constant passes unchanged.
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

// The filter whose response at the pass band's end has only just begun to fall: a short filter falls slowly,
// so it must cut later.
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

// Keeps each point within half a sample of where it was, along each index axis.
class Bound {
  public:
    explicit Bound(const Mat3d& index_to_physical) : to_physical_(index_to_physical) {
        const auto column = [&](std::size_t a) {
            return Vec3d{to_physical_[0][a], to_physical_[1][a], to_physical_[2][a]};
        };
        const double determinant = dot(column(0), cross(column(1), column(2)));
        if (!(std::abs(determinant) > 0)) throw InputError("smooth: the bound's matrix is singular");
        for (std::size_t a = 0; a < 3; ++a)
            to_index_[a] = (1 / determinant) * cross(column((a + 1) % 3), column((a + 2) % 3));
    }

    Vec3d operator()(const Vec3d& from, const Vec3d& to) const {
        const Vec3d move = to - from;
        Vec3d bound{};
        for (std::size_t a = 0; a < 3; ++a) {
            const double steps = std::clamp(dot(to_index_[a], move), -0.5, 0.5);
            for (std::size_t r = 0; r < 3; ++r) bound[r] += to_physical_[r][a] * steps;
        }
        return from + bound;
    }

  private:
    const Mat3d to_physical_;
    Mat3d to_index_{};  // its inverse
};

// Puts the points of shells that the filter has all but flattened back. Returns how many such shells there
// are: specks of few triangles, all of whose shape is above the pass band.
std::int64_t restore_flattened(const Mesh& before, Mesh& mesh) {
    const Shells old = find_shells(before), now = find_shells(mesh);
    std::vector<bool> restore(old.all.size(), false);
    for (std::size_t s = 0; s < old.all.size(); ++s) {
        const double v = old.all[s].volume;
        restore[s] = old.all[s].closed && std::abs(now.all[s].volume - v) > std::abs(v) / 2;
    }
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
        const std::uint32_t shell = old.of_point[p];
        if (shell != Shells::kNoShell && restore[shell]) mesh.points[p] = before.points[p];
    }
    return std::count(restore.begin(), restore.end(), true);
}

}  // namespace

Mesh smooth(const Mesh& mesh, const SmoothOptions& options, SmoothStats* stats) {
    if (options.iterations < 0) throw InputError("smooth: the iterations must not be negative");
    if (!(options.pass_band > 0 && options.pass_band < 2))
        throw InputError("smooth: the pass band must lie between 0 and 2");
    check_triangles(mesh);
    if (options.iterations == 0) return mesh;

    const Neighbours neighbours(mesh);
    const std::vector<double> c = low_pass_for(options.iterations, options.pass_band);
    const auto n = mesh.points.size();
    const auto for_each_point = [&](auto&& f) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 4096), [&](const auto& range) {
            for (std::size_t p = range.begin(); p < range.end(); ++p) f(p);
        });
    };
    // y = T_i(x), with the operator x -> (x + mean of neighbours) / 2 in the Chebyshev polynomials T_i.
    std::vector<Vec3d> previous(n), y(n), next(n), sum(n);
    const auto average = [&](std::size_t p) {  // twice the operator
        const std::size_t begin = neighbours.start[p], end = neighbours.start[p + 1];
        if (begin == end) return 2 * y[p];
        Vec3d mean{};
        for (std::size_t i = begin; i < end; ++i) mean = mean + y[neighbours.points[i]];
        return y[p] + (1 / static_cast<double>(end - begin)) * mean;
    };
    for_each_point([&](std::size_t p) {
        y[p] = to_double(mesh.points[p]);
        sum[p] = c[0] * y[p];
    });
    for (std::size_t i = 1; i < c.size(); ++i) {
        report_progress(options.progress, static_cast<double>(i) / static_cast<double>(c.size()));
        for_each_point([&](std::size_t p) {
            next[p] = i == 1 ? 0.5 * average(p) : average(p) - previous[p];
            sum[p] = sum[p] + c[i] * next[p];
        });
        previous.swap(y);
        y.swap(next);
    }

    Mesh result;
    result.triangles = mesh.triangles;
    result.points.resize(n);
    const std::optional<Bound> bound = options.bound ? std::optional<Bound>(*options.bound) : std::nullopt;
    for_each_point([&](std::size_t p) {
        if (neighbours.start[p] == neighbours.start[p + 1])
            result.points[p] = mesh.points[p];
        else
            result.points[p] = to_float(bound ? (*bound)(to_double(mesh.points[p]), sum[p]) : sum[p]);
    });
    const std::int64_t restored = restore_flattened(mesh, result);
    if (stats) stats->restored_shells = restored;
    if (!mesh.normals.empty()) result.normals = point_normals(result);
    return result;
}

}  // namespace marrow
