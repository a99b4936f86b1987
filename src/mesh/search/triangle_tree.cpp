// Builds a tree of boxes over triangles.
#include "triangle_tree.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "base/parallel.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow::internal {

namespace {

void set_bounds(BoxTree::Node& node, std::size_t i, const Bounds& bounds) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lower[axis][i] = bounds.lower[axis];
        node.upper[axis][i] = bounds.upper[axis];
    }
}

// Unused entries repeat a triangle, so they do not change the bounds.
Bounds bounds_of_leaf(const BoxTree::Leaf& leaf) {
    Bounds bounds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] = bounds.upper[axis] = leaf.corners[0][axis][0];
        for (const auto& corner : leaf.corners) {
            for (const float x : corner[axis]) {
                bounds.lower[axis] = std::min(bounds.lower[axis], x);
                bounds.upper[axis] = std::max(bounds.upper[axis], x);
            }
        }
    }
    return bounds;
}

}  // namespace

TriangleTree::TriangleTree(const MeshView& mesh) : order_(along_morton_curve(mesh)) {
    Splits splits{{{}}, {}};
    split(0, {0, static_cast<std::uint32_t>(order_.size())}, splits);
    const std::vector<Range>& ranges = splits.leaves;
    tree_.nodes.resize(splits.nodes.size());
    tree_.leaves.resize(ranges.size());
    parallel_for(std::size_t{0}, tree_.nodes.size(), [&](std::size_t n) {
        BoxTree::Node& node = tree_.nodes[n];
        std::copy(splits.nodes[n].child.begin(), splits.nodes[n].child.end(), node.child);
        node.count = splits.nodes[n].count;
        for (std::size_t i = 0; i < node.count; ++i) {
            if ((node.child[i] & BoxTree::kLeaf) == 0) continue;
            const std::uint32_t leaf = node.child[i] ^ BoxTree::kLeaf;
            fill(tree_.leaves[leaf], ranges[leaf], mesh);
            set_bounds(node, i, bounds_of_leaf(tree_.leaves[leaf]));
        }
    });
    merge_bounds();
}

// Splits where the curve changes from one half of a cube to the other: at the highest bit in which the keys
// differ.
std::uint32_t TriangleTree::split_position(const Range& range) const {
    const std::uint32_t last = order_[range.end - 1].key, difference = order_[range.begin].key ^ last;
    if (difference == 0) return range.begin + range.size() / 2;
    const std::uint32_t half = last & ~(std::bit_floor(difference) - 1);
    const auto found = std::partition_point(order_.begin() + range.begin, order_.begin() + range.end,
                                            [&](const MortonKey& k) { return k.key < half; });
    return static_cast<std::uint32_t>(found - order_.begin());
}

// Splits a range into up to eight children of a node, and splits these in turn.
void TriangleTree::split(std::size_t node, const Range& range, Splits& splits) const {
    const auto is_smaller = [](const Range& a, const Range& b) { return a.size() < b.size(); };
    std::uint32_t count = 1;
    std::array<Range, BoxTree::kWidth> children{range};
    while (count < BoxTree::kWidth) {
        Range& largest = *std::max_element(children.begin(), children.begin() + count, is_smaller);
        if (largest.size() <= BoxTree::kWidth) break;
        const std::uint32_t middle = split_position(largest);
        children[count++] = {middle, largest.end};
        largest.end = middle;
    }
    splits.nodes[node].count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (children[i].size() <= BoxTree::kWidth) {
            splits.nodes[node].child[i] = BoxTree::kLeaf | static_cast<std::uint32_t>(splits.leaves.size());
            splits.leaves.push_back(children[i]);
            continue;
        }
        const auto child = static_cast<std::uint32_t>(splits.nodes.size());
        splits.nodes[node].child[i] = child;
        splits.nodes.emplace_back();
        split(child, children[i], splits);
    }
}

// Triangles that follow each other along the curve may be anywhere in the mesh, so those of the next leaves
// are fetched.
void TriangleTree::fill(BoxTree::Leaf& leaf, const Range& range, const MeshView& mesh) const {
    constexpr std::size_t kAhead = 24;
    for (std::size_t i = range.begin; i < range.end; ++i) {
        if (i + 2 * kAhead >= order_.size()) break;
        hwy::Prefetch(&mesh.triangles[along_curve(i + 2 * kAhead)]);
        for (const std::uint32_t p : mesh.triangles[along_curve(i + kAhead)]) hwy::Prefetch(&mesh.points[p]);
    }
    leaf.count = range.size();
    for (std::uint32_t i = 0; i < BoxTree::kWidth; ++i) {
        const std::uint32_t t = leaf.triangle[i] = along_curve(range.begin + std::min(i, range.size() - 1));
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3f& p = mesh.points[mesh.triangles[t][c]];
            for (std::size_t axis = 0; axis < 3; ++axis) leaf.corners[c][axis][i] = p[axis];
        }
    }
}

// Sets the bounds of the children that are nodes, from the last node to the root.
void TriangleTree::merge_bounds() {
    for (std::size_t n = tree_.nodes.size(); n-- > 0;) {
        BoxTree::Node& node = tree_.nodes[n];
        for (std::size_t i = 0; i < node.count; ++i) {
            if ((node.child[i] & BoxTree::kLeaf) != 0) continue;
            const BoxTree::Node& child = tree_.nodes[node.child[i]];
            Bounds bounds;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                bounds.lower[axis] = *std::min_element(child.lower[axis], child.lower[axis] + child.count);
                bounds.upper[axis] = *std::max_element(child.upper[axis], child.upper[axis] + child.count);
            }
            set_bounds(node, i, bounds);
        }
    }
}

// After Moeller and Trumbore 1997. Negative if the ray misses the triangle.
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
