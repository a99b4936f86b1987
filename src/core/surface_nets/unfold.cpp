// Moves the corners of folds by half of their path, three quarters, and so on to the start.
#include "unfold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <mutex>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/vector.h>

#include "base/parallel.h"
#include "mesh/triangle_intersection.h"

namespace marrow::internal {
namespace {

// Two triangles at an edge: both ends of the edge, and the corners opposite to it.
using Hinge = std::array<std::uint32_t, 4>;

// The edges of a mesh by their lower ends.
class Hinges {
  public:
    explicit Hinges(const Mesh& mesh) : first_(mesh.points.size() + 1), sides_(3 * mesh.triangles.size()) {
        std::fill(first_.begin(), first_.end(), std::size_t{0});
        for_each_side(mesh, [&](std::uint32_t low, std::uint32_t, std::uint32_t) { ++first_[low + 1]; });
        for (std::size_t p = 1; p < first_.size(); ++p) first_[p] += first_[p - 1];
        std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
        for_each_side(mesh, [&](std::uint32_t low, std::uint32_t high, std::uint32_t opposite) {
            sides_[next[low]++] = {high, opposite};
        });
    }

    // Returns the hinges for which f is true, sorted. Runs on all threads.
    template <class F>
    std::vector<Hinge> find(const F& f) const {
        std::mutex mutex;
        std::vector<Hinge> all;
        parallel_for_ranges(std::size_t{0}, first_.size() - 1, 4096, [&](const auto& range) {
            std::vector<Hinge> found;
            for (std::size_t p = range.begin(); p < range.end(); ++p) {
                for (std::size_t i = first_[p]; i < first_[p + 1]; ++i) {
                    for (std::size_t k = i + 1; k < first_[p + 1]; ++k) {
                        if (sides_[i].end != sides_[k].end) continue;
                        const Hinge hinge{static_cast<std::uint32_t>(p), sides_[i].end, sides_[i].opposite,
                                          sides_[k].opposite};
                        if (f(hinge)) found.push_back(hinge);
                    }
                }
            }
            const std::lock_guard lock(mutex);
            all.insert(all.end(), found.begin(), found.end());
        });
        std::sort(all.begin(), all.end());
        return all;
    }

  private:
    // A triangle's edge from a lower end.
    struct Side {
        std::uint32_t end, opposite;
    };

    template <class F>
    static void for_each_side(const Mesh& mesh, const F& f) {
        for (const Triangle& t : mesh.triangles) {
            for (std::size_t c = 0; c < 3; ++c) {
                const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
                f(low, high, t[(c + 2) % 3]);
            }
        }
    }

    Buffer<std::size_t> first_;  // side of each point
    Buffer<Side> sides_;
};

bool is_folded(std::span<const Vec3f> points, const Hinge& hinge) {
    const auto point = [&](std::size_t i) { return to_double(points[hinge[i]]); };
    const Vec3d a = point(0), b = point(1), c = point(2), d = point(3), edge = b - a;
    const auto height = [&](const Vec3d& p) { return dot(edge, edge) * (p - a) - dot(p - a, edge) * edge; };
    return dot(height(c), height(d)) > 0 && orient3d(a, b, c, d) == 0;
}

}  // namespace

std::size_t unfold(Mesh& net, const std::function<std::span<const Vec3f>()>& start) {
    struct Path {
        Vec3f end;
        int steps = 0;
    };
    constexpr int kAtStart = 5;  // steps
    std::map<std::uint32_t, Path> paths;
    const Hinges hinges(net);
    for (;;) {
        const auto folded = hinges.find([&](const Hinge& hinge) { return is_folded(net.points, hinge); });
        std::vector<std::uint32_t> corners;
        for (const Hinge& hinge : folded) corners.insert(corners.end(), hinge.begin(), hinge.end());
        std::sort(corners.begin(), corners.end());
        corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
        std::erase_if(corners, [&](std::uint32_t p) {
            return paths.try_emplace(p, Path{net.points[p]}).first->second.steps == kAtStart;
        });
        if (corners.empty()) return paths.size();
        const std::span<const Vec3f> from = start();
        for (const std::uint32_t p : corners) {
            Path& path = paths.at(p);
            const Vec3d begin = to_double(from[p]);
            net.points[p] =
                ++path.steps == kAtStart
                    ? from[p]
                    : to_float(begin + std::ldexp(1.0, -path.steps) * (to_double(path.end) - begin));
        }
    }
}

}  // namespace marrow::internal
