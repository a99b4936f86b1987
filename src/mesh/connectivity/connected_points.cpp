// Gives connected points the same label wherever this is easy, and unites what is left in disjoint sets.
//
// Threads do this at the same time, without locks. The parent of a point is always the point itself or a
// lower one of its component. In the first pass, threads overwrite parents, so that connections may be lost.
// In the last pass, only a point that represents its set is given another parent, by compare and swap, and
// paths are shortened to ancestors only, so that none is lost: in the end, only the lowest point of a
// component is its own parent. Each pass ends before the next one begins. Within one, an old parent is still
// an ancestor, so that loads and stores need no order.
#include "connected_points.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>

#include "base/parallel.h"

namespace marrow::internal {

namespace {

constexpr std::size_t kGrain = 8192;  // points or triangles

// Calls f(Index) for each index below `count`, on all threads. Each range has its own copy of f, since
// compilers keep what a local variable has captured in registers. Other memory is loaded again after each
// atomic operation.
template <class Index, class F>
void for_each(std::size_t count, const F& f) {
    parallel_for_ranges(std::size_t{0}, count, kGrain, [&](const auto& range) {
        const F own = f;
        for (std::size_t i = range.begin(); i < range.end(); ++i) own(static_cast<Index>(i));
    });
}

// Refers to an array with the parent of each point.
class Parents {
  public:
    explicit Parents(std::atomic<std::uint32_t>* parents) : parents_(parents) {}

    std::uint32_t of(std::uint32_t p) const { return parents_[p].load(std::memory_order_relaxed); }
    void set(std::uint32_t p, std::uint32_t parent) const {
        parents_[p].store(parent, std::memory_order_relaxed);
    }

    template <class... Points>
    void set_all(std::uint32_t parent, Points... points) const {
        (set(points, parent), ...);
    }

    // The point that represents the set of p. Halves the path to it.
    std::uint32_t representative(std::uint32_t p) const {
        for (std::uint32_t parent = of(p); parent != p; parent = of(p)) {
            const std::uint32_t next = of(parent);
            if (next != parent) set(p, next);
            p = next;
        }
        return p;
    }

    void unite(std::uint32_t a, std::uint32_t b) const {
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
    std::atomic<std::uint32_t>* parents_;
};

}  // namespace

Buffer<std::uint32_t> lowest_connected_points(const MeshView& mesh) {
    const std::size_t points = mesh.points.size();
    const std::span<const Triangle> triangles = mesh.triangles;
    Buffer<std::atomic<std::uint32_t>> memory(points);
    const Parents parents(memory.data());
    for_each<std::uint32_t>(points, [parents](std::uint32_t p) { parents.set(p, p); });
    // Without branches. This forgets that some points are connected, but of neighbouring triangles only few.
    for_each<std::size_t>(triangles.size(), [parents, triangles](std::size_t t) {
        const auto [a, b, c] = triangles[t];
        const std::uint32_t of_a = parents.of(a), of_b = parents.of(b), of_c = parents.of(c);
        const std::uint32_t lowest = std::min(std::min(of_a, of_b), of_c);
        parents.set_all(lowest, of_a, of_b, of_c, a, b, c);
    });
    for_each<std::uint32_t>(points,
                            [parents](std::uint32_t p) { parents.set(p, parents.representative(p)); });
    for_each<std::size_t>(triangles.size(), [parents, triangles](std::size_t t) {
        const auto [a, b, c] = triangles[t];
        if (parents.of(a) == parents.of(b) && parents.of(a) == parents.of(c)) return;
        parents.unite(a, b);
        parents.unite(a, c);
    });
    Buffer<std::uint32_t> lowest(points);
    for_each<std::uint32_t>(
        points, [parents, to = lowest.data()](std::uint32_t p) { to[p] = parents.representative(p); });
    return lowest;
}

}  // namespace marrow::internal
