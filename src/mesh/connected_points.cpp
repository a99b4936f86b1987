// Gives connected points the same label wherever this is easy, and unites what is left in disjoint sets.
//
// Threads do this at the same time, without locks. Whatever their order, the parent of a point is the point
// itself or a lower one of the same component, and a set joins another one only by its representative. So in
// the end, only the lowest point of a component is its own parent.
#include "connected_points.h"

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "base/parallel.h"

namespace marrow::internal {

namespace {

constexpr std::size_t kGrain = 8192;  // points or triangles

class Parents {
  public:
    explicit Parents(std::size_t points) : parents_(points) {
        for_each_point([&](std::uint32_t p) { set(p, p); });
    }

    std::uint32_t of(std::uint32_t p) const { return parents_[p].load(std::memory_order_relaxed); }
    void set(std::uint32_t p, std::uint32_t parent) { parents_[p].store(parent, std::memory_order_relaxed); }

    template <class... Points>
    void set_all(std::uint32_t parent, Points... points) {
        (set(points, parent), ...);
    }

    template <class F>
    void for_each_point(const F& f) const {
        parallel_for_ranges(std::size_t{0}, parents_.size(), kGrain, [&](const auto& range) {
            for (std::size_t p = range.begin(); p < range.end(); ++p) f(static_cast<std::uint32_t>(p));
        });
    }

    // The point that represents the set of p. Halves the path to it.
    std::uint32_t representative(std::uint32_t p) {
        for (std::uint32_t parent = of(p); parent != p; parent = of(p)) {
            const std::uint32_t next = of(parent);
            if (next != parent) set(p, next);
            p = next;
        }
        return p;
    }

    void unite(std::uint32_t a, std::uint32_t b) {
        while (true) {
            a = representative(a);
            b = representative(b);
            if (a == b) return;
            std::uint32_t higher = std::max(a, b);
            // Fails if another thread has united this set since.
            if (parents_[higher].compare_exchange_strong(higher, std::min(a, b), std::memory_order_relaxed))
                return;
        }
    }

  private:
    std::vector<std::atomic<std::uint32_t>> parents_;
};

}  // namespace

std::vector<std::uint32_t> lowest_connected_points(const MeshView& mesh) {
    Parents parents(mesh.points.size());
    const auto for_each_triangle = [&](const auto& f) {
        parallel_for_ranges(std::size_t{0}, mesh.triangles.size(), kGrain, [&](const auto& range) {
            for (std::size_t t = range.begin(); t < range.end(); ++t) f(mesh.triangles[t]);
        });
    };
    // Without branches. This forgets that some points are connected, but of neighbouring triangles only few.
    for_each_triangle([&](const Triangle& t) {
        const std::uint32_t a = parents.of(t[0]), b = parents.of(t[1]), c = parents.of(t[2]);
        const std::uint32_t lowest = std::min(std::min(a, b), c);
        parents.set_all(lowest, a, b, c, t[0], t[1], t[2]);
    });
    parents.for_each_point([&](std::uint32_t p) { parents.set(p, parents.representative(p)); });
    for_each_triangle([&](const Triangle& t) {
        const auto& [a, b, c] = t;
        if (parents.of(a) == parents.of(b) && parents.of(a) == parents.of(c)) return;
        parents.unite(a, b);
        parents.unite(a, c);
    });
    std::vector<std::uint32_t> lowest(mesh.points.size());
    parents.for_each_point([&](std::uint32_t p) { lowest[p] = parents.representative(p); });
    return lowest;
}

}  // namespace marrow::internal
