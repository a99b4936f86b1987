#include "triangle_tree.h"

#include <tbb/parallel_invoke.h>

#include <bit>
#include <utility>

#include "triangle_distance.h"

namespace marrow::internal {

namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

double squared_distance_to_box(const TriangleTree::Box& box, const Vec3d& place) {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double below = box.lower[axis] - place[axis], above = place[axis] - box.upper[axis];
        const double outside = std::max(std::max(below, above), 0.0);
        sum += outside * outside;
    }
    return sum;
}

}  // namespace

TriangleTree::TriangleTree(const Mesh& mesh)
    : leaves_(std::bit_ceil((mesh.triangles.size() + kLeafSize - 1) / kLeafSize)),
      boxes_(2 * leaves_, Box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}}) {  // empty
    triangles_.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
        const auto index = static_cast<std::uint32_t>(triangles_.size());
        triangles_.push_back({mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], index});
    }
    part(1, 0, leaves_ * kLeafSize);
}

// Sorts the triangles [first, first + size), as far as there are any, under a node.
void TriangleTree::part(std::size_t node, std::size_t first, std::size_t size) {
    const auto begin = triangles_.begin() + static_cast<std::ptrdiff_t>(std::min(first, triangles_.size()));
    const auto end =
        triangles_.begin() + static_cast<std::ptrdiff_t>(std::min(first + size, triangles_.size()));
    Box& box = boxes_[node];
    for (auto t = begin; t != end; ++t) {
        const Box other = t->box();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::min(box.lower[axis], other.lower[axis]);
            box.upper[axis] = std::max(box.upper[axis], other.upper[axis]);
        }
    }
    if (node >= leaves_) return;
    const std::size_t half = size / 2;
    if (first + half < triangles_.size()) {
        std::size_t axis = 0;
        for (const std::size_t other : {1u, 2u}) {
            if (box.upper[other] - box.lower[other] > box.upper[axis] - box.lower[axis]) axis = other;
        }
        const auto middle = [axis](const Corners& t) { return (t.a[axis] + t.b[axis]) + t.c[axis]; };
        std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), end,
                         [&](const Corners& s, const Corners& t) { return middle(s) < middle(t); });
    }
    const auto left = [&] { part(2 * node, first, half); };
    const auto right = [&] { part(2 * node + 1, first + half, half); };
    if (size > 4096) {
        tbb::parallel_invoke(left, right);
    } else {
        left();
        right();
    }
}

void TriangleTree::approach_leaf(std::size_t leaf, const Vec3d& place, Nearest& squared) const {
    const std::size_t end = std::min((leaf + 1) * kLeafSize, triangles_.size());
    for (std::size_t i = leaf * kLeafSize; i < end; ++i) {
        const Corners& t = triangles_[i];
        const double d = squared_distance_to_triangle(place, to_double(t.a), to_double(t.b), to_double(t.c),
                                                      squared.distance);
        if (d < squared.distance) squared = {d, t.triangle};
    }
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3d& place, double enough, std::size_t* leaf) const {
    struct Node {
        std::size_t index;
        double squared_distance;  // to its box
    };
    std::array<Node, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = {1, squared_distance_to_box(boxes_[1], place)};
    Nearest squared{std::numeric_limits<double>::infinity(), 0};
    if (leaf) approach_leaf(*leaf, place, squared);
    while (depth > 0 && squared.distance > enough * enough) {
        const Node node = stack[--depth];
        if (node.squared_distance >= squared.distance) continue;
        if (node.index >= leaves_) {
            const double before = squared.distance;
            approach_leaf(node.index - leaves_, place, squared);
            if (leaf && squared.distance < before) *leaf = node.index - leaves_;
            continue;
        }
        const std::size_t child = 2 * node.index;
        Node near{child, squared_distance_to_box(boxes_[child], place)};
        Node far{child + 1, squared_distance_to_box(boxes_[child + 1], place)};
        if (far.squared_distance < near.squared_distance) std::swap(near, far);
        if (far.squared_distance < squared.distance) stack[depth++] = far;
        if (near.squared_distance < squared.distance) stack[depth++] = near;  // first
    }
    return {std::sqrt(squared.distance), squared.triangle};
}

bool TriangleTree::is_within(const Vec3d& place, double distance) const {
    const double squared = distance * distance;
    std::array<std::size_t, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = 1;
    while (depth > 0) {
        const std::size_t node = stack[--depth];
        if (node >= leaves_) {
            const std::size_t first = (node - leaves_) * kLeafSize;
            for (std::size_t i = first; i < std::min(first + kLeafSize, triangles_.size()); ++i) {
                const Corners& t = triangles_[i];
                if (squared_distance_to_triangle(place, to_double(t.a), to_double(t.b), to_double(t.c),
                                                 squared) <= squared)
                    return true;
            }
            continue;
        }
        for (const std::size_t child : {2 * node + 1, 2 * node}) {
            if (squared_distance_to_box(boxes_[child], place) <= squared) stack[depth++] = child;
        }
    }
    return false;
}

TriangleTree::Box TriangleTree::Corners::box() const {
    Box box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        box.lower[axis] = std::min({a[axis], b[axis], c[axis]});
        box.upper[axis] = std::max({a[axis], b[axis], c[axis]});
    }
    return box;
}

// After Moeller and Trumbore 1997; negative where the ray misses.
double TriangleTree::hit(const Corners& t, const Vec3d& origin, const Vec3d& direction) {
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
