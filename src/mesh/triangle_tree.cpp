#include "triangle_tree.h"

#include <tbb/parallel_for.h>

#include <bit>
#include <vector>

#include "morton_curve.h"
#include "vector.h"

namespace marrow::internal {

namespace {

constexpr float kNowhere = std::numeric_limits<float>::infinity();

}  // namespace

TriangleTree::TriangleTree(const Mesh& mesh) {
    const std::vector<OnCurve> order = along_morton_curve(mesh);
    tree_.triangles.resize(order.size());
    tbb::parallel_for(std::size_t{0}, order.size(), [&](std::size_t i) {
        const Triangle& t = mesh.triangles[order[i].triangle];
        tree_.triangles[i] = {mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], order[i].triangle};
    });
    part(order);
    find_boxes();
}

// Parts the triangles where the curve goes from one half of a cube to the other, eight ranges a node.
void TriangleTree::part(const std::vector<OnCurve>& order) {
    struct Range {
        std::uint32_t begin, end;

        std::uint32_t size() const { return end - begin; }
    };
    const auto middle_of = [&](const Range& r) {
        const std::uint32_t last = order[r.end - 1].key, differs = order[r.begin].key ^ last;
        if (differs == 0) return r.begin + r.size() / 2;
        const std::uint32_t half = last & ~(std::bit_floor(differs) - 1);
        const auto found = std::partition_point(order.begin() + r.begin, order.begin() + r.end,
                                                [&](const OnCurve& k) { return k.key < half; });
        return static_cast<std::uint32_t>(found - order.begin());
    };
    const auto is_smaller = [](const Range& a, const Range& b) { return a.size() < b.size(); };
    std::vector<Range> ranges{{0, static_cast<std::uint32_t>(order.size())}};  // of each node
    for (std::size_t n = 0; n < ranges.size(); ++n) {
        const Range range = ranges[n];
        if (range.size() <= kWidth) {
            tree_.under.push_back({range.begin, static_cast<std::uint16_t>(range.size()), true});
            continue;
        }
        std::uint16_t count = 1;
        std::array<Range, kWidth> parts{range};
        while (count < kWidth) {
            Range& largest = *std::max_element(parts.begin(), parts.begin() + count, is_smaller);
            if (largest.size() <= kWidth) break;
            const std::uint32_t middle = middle_of(largest);
            parts[count++] = {middle, largest.end};
            largest.end = middle;
        }
        tree_.under.push_back({static_cast<std::uint32_t>(ranges.size()), count, false});
        ranges.insert(ranges.end(), parts.begin(), parts.begin() + count);
    }
}

void TriangleTree::find_boxes() {
    constexpr Vec3f kMost{kNowhere, kNowhere, kNowhere}, kLeast{-kNowhere, -kNowhere, -kNowhere};
    tree_.boxes.resize(tree_.under.size());
    for (std::size_t n = tree_.under.size(); n-- > 0;) {
        const BoxTree::Under& under = tree_.under[n];
        for (std::uint32_t child = 0; child < kWidth; ++child) {
            Box box{kMost, kLeast};
            if (child < under.count && under.triangles) {
                box = box_of(tree_.triangles[under.first + child]);
            } else if (child < under.count) {
                const EightBoxes& below = tree_.boxes[under.first + child];
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    box.lower[axis] = *std::min_element(below.lower[axis], below.lower[axis] + kWidth);
                    box.upper[axis] = *std::max_element(below.upper[axis], below.upper[axis] + kWidth);
                }
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                tree_.boxes[n].lower[axis][child] = box.lower[axis];
                tree_.boxes[n].upper[axis][child] = box.upper[axis];
            }
        }
    }
}

TriangleTree::Box TriangleTree::box_of(const PlacedCorners& t) {
    Box box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        box.lower[axis] = std::min({t.a[axis], t.b[axis], t.c[axis]});
        box.upper[axis] = std::max({t.a[axis], t.b[axis], t.c[axis]});
    }
    return box;
}

// After Moeller and Trumbore 1997; negative where the ray misses.
double TriangleTree::hit(const PlacedCorners& t, const Vec3d& origin, const Vec3d& direction) {
    const Vec3d a = to_double(t.a), u = to_double(t.b) - a, v = to_double(t.c) - a, from_a = origin - a;
    const Vec3d across = cross(direction, v);
    const double determinant = dot(u, across);
    if (determinant == 0) return -1;
    const double along_u = dot(from_a, across) / determinant;
    const Vec3d q = cross(from_a, u);
    const double along_v = dot(direction, q) / determinant;
    if (along_u < 0 || along_v < 0 || along_u + along_v > 1) return -1;
    return dot(v, q) / determinant;
}

}  // namespace marrow::internal
