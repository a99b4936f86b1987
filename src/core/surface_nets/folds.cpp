// Finds folds by looking at all triangles of each edge, and moves their corners back by half of their path,
// three quarters, and so on to the start.
#include "folds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include <marrow/vector.h>

#include "base/for_each_range.h"
#include "label_meshes.h"
#include "mesh/geometry/triangle_intersection.h"

namespace marrow::internal {
namespace {

// Calls f(lower end, higher end, opposite corner) for each edge of each triangle.
template <class F>
void for_each_side(const Mesh& mesh, Stage& stage, const F& f) {
    for_each_triangle(mesh, stage, [&](const Triangle& t) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
            f(low, high, t[(c + 2) % 3]);
        }
    });
}

}  // namespace

Folds::Folds(Mesh& net, const Progress& progress)
    : net_(net), first_(net.points.size() + 1), sides_(3 * net.triangles.size()) {
    Stage stage(progress, 0, 1, 2 * net.triangles.size());
    std::fill(first_.begin(), first_.end(), std::size_t{0});
    for_each_side(net, stage,
                  [&](std::uint32_t low, std::uint32_t, std::uint32_t) { ++first_[low + std::size_t{1}]; });
    for (std::size_t p = 1; p < first_.size(); ++p) first_[p] += first_[p - 1];
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_side(net, stage, [&](std::uint32_t low, std::uint32_t high, std::uint32_t opposite) {
        sides_[next[low]++] = {high, opposite};
    });
}

bool Folds::open(const std::function<std::span<const Vec3f>()>& start, const Progress& progress) {
    struct Path {
        Vec3f end;
        int steps = 0;
    };
    constexpr int kAtStart = 5;  // steps
    std::map<std::uint32_t, Path> paths;
    for (;;) {
        std::vector<Hinge> folded = find(progress);
        if (folded.empty()) return !paths.empty();
        const std::span<const Vec3f> from = start();
        std::erase_if(folded, [&](const Hinge& hinge) { return is_folded(from, hinge); });
        std::vector<std::uint32_t> corners;
        for (const Hinge& hinge : folded) corners.insert(corners.end(), hinge.begin(), hinge.end());
        std::sort(corners.begin(), corners.end());
        corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
        std::erase_if(corners, [&](std::uint32_t p) {
            return paths.try_emplace(p, Path{net_.points[p]}).first->second.steps == kAtStart;
        });
        if (corners.empty()) return !paths.empty();
        for (const std::uint32_t p : corners) {
            Path& path = paths.at(p);
            const Vec3d begin = to_double(from[p]), way = to_double(path.end) - begin;
            ++path.steps;
            net_.points[p] =
                path.steps == kAtStart ? from[p] : to_float(begin + std::ldexp(1.0, -path.steps) * way);
        }
    }
}

// Whether the triangles have a common plane, and are on the same side of the edge.
bool Folds::is_folded(std::span<const Vec3f> points, const Hinge& hinge) {
    const auto point = [&](std::size_t i) { return to_double(points[hinge[i]]); };
    const Vec3d a = point(0), b = point(1), c = point(2), d = point(3), edge = b - a;
    const auto height = [&](const Vec3d& p) { return dot(edge, edge) * (p - a) - dot(p - a, edge) * edge; };
    const Vec3d c_height = height(c), d_height = height(d);
    const double cosine = dot(c_height, d_height);  // times both lengths
    // Nearly all triangles at an edge are on opposite sides, by far more than rounding.
    if (cosine < 0 && cosine * cosine > 1e-12 * dot(c_height, c_height) * dot(d_height, d_height))
        return false;
    if (orient3d(a, b, c, d) != 0) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        // The plane through the edge along the axis.
        Vec3d beside = a;
        beside[axis] = beside[axis] == 0 ? 1 : 0;
        const int c_side = orient3d(a, b, beside, c), d_side = orient3d(a, b, beside, d);
        if (c_side != 0) return c_side == d_side;
    }
    return false;
}

// Returns them sorted.
std::vector<Folds::Hinge> Folds::find(const Progress& progress) const {
    std::mutex mutex;
    std::vector<Hinge> all;
    for_each_range(net_.points.size(), 4096, progress, 0, 1, [&](std::size_t begin, std::size_t end) {
        std::vector<Hinge> found;
        for (std::size_t p = begin; p < end; ++p) {
            for (std::size_t i = first_[p]; i < first_[p + 1]; ++i) {
                for (std::size_t k = i + 1; k < first_[p + 1]; ++k) {
                    if (sides_[i].end != sides_[k].end) continue;
                    const Hinge hinge{static_cast<std::uint32_t>(p), sides_[i].end, sides_[i].opposite,
                                      sides_[k].opposite};
                    if (is_folded(net_.points, hinge)) found.push_back(hinge);
                }
            }
        }
        const std::lock_guard lock(mutex);
        all.insert(all.end(), found.begin(), found.end());
    });
    std::sort(all.begin(), all.end());
    return all;
}

}  // namespace marrow::internal
