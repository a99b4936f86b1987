// Compares points and triangles in their order, and marks cells of space around those that differ.
#include "changed_triangles.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "base/parallel.h"
#include "mesh/geometry/bounds.h"
#include "mesh/search/triangle_tree.h"

namespace marrow::internal {

namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};

// Calls f(i, k) for each i below `count`, where k is the next of `count_before` elements with equal(i, k), or
// kNone. Where many elements in a row are missing, it may not find it.
template <class Equal, class F>
void match(std::size_t count, std::size_t count_before, const Equal& equal, const F& f) {
    constexpr std::size_t kMostMissing = 256;
    std::size_t next = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t end = std::min(next + kMostMissing, count_before);
        std::size_t k = next;
        while (k < end && !equal(i, k)) ++k;
        if (k < end) next = k + 1;
        f(i, k < end ? static_cast<std::uint32_t>(k) : kNone);
    }
}

// Calls f(t) for the triangles of a mesh that `before` does not have at the same positions.
template <class F>
void for_each_new_triangle(const MeshView& mesh, const MeshView& before, const F& f) {
    Buffer<std::uint32_t> old(mesh.points.size());
    match(
        mesh.points.size(), before.points.size(),
        [&](std::size_t i, std::size_t k) { return mesh.points[i] == before.points[k]; },
        [&](std::size_t i, std::uint32_t k) { old[i] = k; });
    match(
        mesh.triangles.size(), before.triangles.size(),
        [&](std::size_t i, std::size_t k) {
            const Triangle &now = mesh.triangles[i], &then = before.triangles[k];
            return old[now[0]] == then[0] && old[now[1]] == then[1] && old[now[2]] == then[2];
        },
        [&](std::size_t i, std::uint32_t k) {
            if (k == kNone) f(mesh.triangles[i]);
        });
}

// Equal cells over the bounds of a mesh, some of which are marked.
class Cells {
  public:
    explicit Cells(const Bounds& bounds) : lower_(bounds.lower) {
        float longest = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            longest = std::max(longest, bounds.upper[axis] - bounds.lower[axis]);
        if (longest > 0) scale_ = kMostAlongAxis / longest;
        std::size_t size = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            last_[axis] = whole((bounds.upper[axis] - bounds.lower[axis]) * scale_);
            size *= last_[axis] + std::size_t{1};
        }
        marked_.assign(size, 0);
    }

    void mark(const Bounds& box) {
        any_of(box, [&](std::size_t cell) {
            marked_[cell] = 1;
            return false;
        });
    }
    bool overlap(const Bounds& box) const {
        return any_of(box, [&](std::size_t cell) { return marked_[cell] != 0; });
    }

  private:
    // Never decreases with the coordinate, so that boxes which touch have a cell in common.
    std::uint32_t cell(std::size_t axis, float x) const {
        return std::min(whole((x - lower_[axis]) * scale_), last_[axis]);
    }
    // NaN, of a surface without extent, becomes 0.
    static std::uint32_t whole(float cells) {
        return cells > 0 ? static_cast<std::uint32_t>(std::min(cells, kMostAlongAxis)) : 0;
    }

    // Whether f is true for any cell of a box.
    template <class F>
    bool any_of(const Bounds& box, const F& f) const {
        std::array<std::uint32_t, 3> first, last;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            first[axis] = cell(axis, box.lower[axis]);
            last[axis] = cell(axis, box.upper[axis]);
        }
        for (std::size_t z = first[2]; z <= last[2]; ++z) {
            for (std::size_t y = first[1]; y <= last[1]; ++y) {
                for (std::size_t x = first[0]; x <= last[0]; ++x)
                    if (f((z * (last_[1] + 1) + y) * (last_[0] + 1) + x)) return true;
            }
        }
        return false;
    }

    static constexpr float kMostAlongAxis = 128;
    const Vec3f lower_;
    float scale_ = 0;  // cells per mm
    std::array<std::uint32_t, 3> last_{};
    std::vector<std::uint8_t> marked_;
};

// Returns the triangles whose boxes are in marked cells.
Buffer<std::uint32_t> triangles_in(const MeshView& mesh, const Cells& cells) {
    constexpr std::size_t kSection = 8192;  // triangles
    const std::size_t triangles = mesh.triangles.size();
    std::vector<std::vector<std::uint32_t>> sections((triangles + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, sections.size(), [&](std::size_t s) {
        for (std::size_t t = s * kSection; t < std::min((s + 1) * kSection, triangles); ++t) {
            if (cells.overlap(bounds_of(mesh, mesh.triangles[t])))
                sections[s].push_back(static_cast<std::uint32_t>(t));
        }
    });
    Buffer<std::uint32_t> all;
    for (const std::vector<std::uint32_t>& section : sections)
        all.insert(all.end(), section.begin(), section.end());
    return all;
}

}  // namespace

Buffer<std::uint32_t> triangles_around_changes(const MeshView& mesh, const MeshView& before,
                                               const std::vector<TrianglePair>& pairs) {
    Cells cells(bounds_of(mesh.points));
    for_each_new_triangle(mesh, before, [&](const Triangle& t) { cells.mark(bounds_of(mesh, t)); });
    for (const TrianglePair& pair : pairs) {
        for (const std::uint32_t t : pair) cells.mark(bounds_of(before, before.triangles[t]));
    }
    return triangles_in(mesh, cells);
}

}  // namespace marrow::internal
