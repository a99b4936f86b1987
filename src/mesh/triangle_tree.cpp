#include "triangle_tree.h"

#include <tbb/parallel_for.h>

#include <bit>
#include <vector>

#include "morton_curve.h"
#include "vector.h"

namespace marrow::internal {

namespace {

void set_box(BoxTree::Node& node, std::size_t i, const TriangleTree::Box& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lower[axis][i] = box.lower[axis];
        node.upper[axis][i] = box.upper[axis];
    }
}

}  // namespace

TriangleTree::TriangleTree(const Mesh& mesh) : order_(along_morton_curve(mesh)) {
    std::vector<Range> ranges;  // of leaves
    tree_.nodes.emplace_back();
    part(0, {0, static_cast<std::uint32_t>(order_.size())}, ranges);
    tree_.leaves.resize(ranges.size());
    tbb::parallel_for(std::size_t{0}, tree_.nodes.size(), [&](std::size_t n) {
        BoxTree::Node& node = tree_.nodes[n];
        for (std::size_t i = 0; i < node.count; ++i) {
            if ((node.under[i] & BoxTree::kLeaf) == 0) continue;
            const std::uint32_t at = node.under[i] ^ BoxTree::kLeaf;
            fill(tree_.leaves[at], ranges[at], mesh);
            set_box(node, i, box_of(tree_.leaves[at]));
        }
    });
    find_boxes();
}

// Where the curve goes from one half of a cube to the other.
std::uint32_t TriangleTree::middle_of(const Range& range) const {
    const std::uint32_t last = order_[range.end - 1].key, differs = order_[range.begin].key ^ last;
    if (differs == 0) return range.begin + range.size() / 2;
    const std::uint32_t half = last & ~(std::bit_floor(differs) - 1);
    const auto found = std::partition_point(order_.begin() + range.begin, order_.begin() + range.end,
                                            [&](const OnCurve& k) { return k.key < half; });
    return static_cast<std::uint32_t>(found - order_.begin());
}

// Parts a range into up to eight, for a node.
void TriangleTree::part(std::uint32_t node, const Range& range, std::vector<Range>& leaves) {
    const auto is_smaller = [](const Range& a, const Range& b) { return a.size() < b.size(); };
    std::uint32_t count = 1;
    std::array<Range, BoxTree::kWidth> parts{range};
    while (count < BoxTree::kWidth) {
        Range& largest = *std::max_element(parts.begin(), parts.begin() + count, is_smaller);
        if (largest.size() <= BoxTree::kWidth) break;
        const std::uint32_t middle = middle_of(largest);
        parts[count++] = {middle, largest.end};
        largest.end = middle;
    }
    tree_.nodes[node].count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (parts[i].size() <= BoxTree::kWidth) {
            tree_.nodes[node].under[i] = BoxTree::kLeaf | static_cast<std::uint32_t>(leaves.size());
            leaves.push_back(parts[i]);
            continue;
        }
        const auto below = tree_.nodes[node].under[i] = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes.emplace_back();
        part(below, parts[i], leaves);
    }
}

void TriangleTree::fill(BoxTree::Leaf& leaf, const Range& range, const Mesh& mesh) const {
    leaf.count = range.size();
    for (std::uint32_t i = 0; i < BoxTree::kWidth; ++i) {
        const std::uint32_t t = leaf.triangle[i] = along_curve(range.begin + std::min(i, range.size() - 1));
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3f& p = mesh.points[mesh.triangles[t][c]];
            for (std::size_t axis = 0; axis < 3; ++axis) leaf.corners[c][axis][i] = p[axis];
        }
    }
}

// Of nodes under nodes, from theirs.
void TriangleTree::find_boxes() {
    for (std::size_t n = tree_.nodes.size(); n-- > 0;) {
        BoxTree::Node& node = tree_.nodes[n];
        for (std::size_t i = 0; i < node.count; ++i) {
            if ((node.under[i] & BoxTree::kLeaf) != 0) continue;
            const BoxTree::Node& below = tree_.nodes[node.under[i]];
            Box box;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                box.lower[axis] = *std::min_element(below.lower[axis], below.lower[axis] + below.count);
                box.upper[axis] = *std::max_element(below.upper[axis], below.upper[axis] + below.count);
            }
            set_box(node, i, box);
        }
    }
}

TriangleTree::Box TriangleTree::box_of(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    Box box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        box.lower[axis] = std::min({a[axis], b[axis], c[axis]});
        box.upper[axis] = std::max({a[axis], b[axis], c[axis]});
    }
    return box;
}

TriangleTree::Box TriangleTree::box_of(const BoxTree::Leaf& leaf) {
    Box box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        box.lower[axis] = box.upper[axis] = leaf.corners[0][axis][0];
        for (const auto& corner : leaf.corners) {
            for (const float x : corner[axis]) {
                box.lower[axis] = std::min(box.lower[axis], x);
                box.upper[axis] = std::max(box.upper[axis], x);
            }
        }
    }
    return box;
}

// After Moeller and Trumbore 1997; negative where the ray misses.
double TriangleTree::hit(const BoxTree::Leaf& leaf, std::size_t i, const Vec3d& origin,
                         const Vec3d& direction) {
    const Vec3d a = to_double(leaf.corner(0, i)), u = to_double(leaf.corner(1, i)) - a,
                v = to_double(leaf.corner(2, i)) - a, from_a = origin - a;
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
