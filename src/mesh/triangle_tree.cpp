#include "triangle_tree.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "vector.h"

namespace marrow::internal {

namespace {

constexpr std::size_t kLeafSize = 4;
constexpr int kBits = 16;  // of each coordinate in a Morton code

std::uint64_t morton_code(const std::array<std::uint64_t, 3>& cell) {
    std::uint64_t code = 0;
    for (int bit = 0; bit < kBits; ++bit) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            code |= (cell[axis] >> bit & 1) << (3 * bit + static_cast<int>(axis));
    }
    return code;
}

// Triangles in Morton order of their middles.
std::vector<std::uint32_t> order_along_curve(const Mesh& mesh) {
    Vec3f lower = mesh.points.front(), upper = lower;
    for (const Vec3f& p : mesh.points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    double extent = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
        extent = std::max(extent, double{upper[axis]} - double{lower[axis]});
    const double scale = extent > 0 ? ((1 << kBits) - 1) / (3 * extent) : 0;

    std::vector<std::pair<std::uint64_t, std::uint32_t>> coded(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, coded.size(), [&](std::size_t i) {
        std::array<std::uint64_t, 3> cell;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double sum = 0;
            for (std::uint32_t p : mesh.triangles[i]) sum += double{mesh.points[p][axis]} - lower[axis];
            cell[axis] = static_cast<std::uint64_t>(sum * scale);
        }
        coded[i] = {morton_code(cell), static_cast<std::uint32_t>(i)};
    });
    tbb::parallel_sort(coded);
    std::vector<std::uint32_t> order(coded.size());
    std::transform(coded.begin(), coded.end(), order.begin(), [](const auto& c) { return c.second; });
    return order;
}

double squared_distance_to_segment(const Vec3d& place, const Vec3d& a, const Vec3d& b) {
    const Vec3d along = b - a, from_a = place - a;
    const double squared_length = dot(along, along);
    const double t = squared_length > 0 ? std::clamp(dot(from_a, along) / squared_length, 0.0, 1.0) : 0;
    const Vec3d apart = from_a - t * along;
    return dot(apart, apart);
}

double squared_distance_to_triangle(const Vec3d& place, const Corners& t) {
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    const double squared_area = dot(n, n);
    const bool above = squared_area > 0 && dot(cross(t.b - t.a, place - t.a), n) >= 0 &&
                       dot(cross(t.c - t.b, place - t.b), n) >= 0 &&
                       dot(cross(t.a - t.c, place - t.c), n) >= 0;
    if (above) {
        const double height = dot(place - t.a, n);
        return height * height / squared_area;
    }
    return std::min({squared_distance_to_segment(place, t.a, t.b),
                     squared_distance_to_segment(place, t.b, t.c),
                     squared_distance_to_segment(place, t.c, t.a)});
}

}  // namespace

TriangleTree::TriangleTree(const Mesh& mesh) : mesh_(mesh), order_(order_along_curve(mesh)) {
    leaves_ = std::bit_ceil((order_.size() + kLeafSize - 1) / kLeafSize);
    constexpr float kFar = std::numeric_limits<float>::infinity();
    boxes_.assign(2 * leaves_, {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}});  // empty
    const auto grow = [](Box& box, const Vec3f& lower, const Vec3f& upper) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            box.lower[axis] = std::min(box.lower[axis], lower[axis]);
            box.upper[axis] = std::max(box.upper[axis], upper[axis]);
        }
    };
    tbb::parallel_for(std::size_t{0}, leaves_, [&](std::size_t leaf) {
        const std::size_t end = std::min((leaf + 1) * kLeafSize, order_.size());
        for (std::size_t i = leaf * kLeafSize; i < end; ++i) {
            for (std::uint32_t p : mesh.triangles[order_[i]])
                grow(boxes_[leaves_ + leaf], mesh.points[p], mesh.points[p]);
        }
    });
    for (std::size_t node = leaves_; node-- > 1;) {
        for (const std::size_t child : {2 * node, 2 * node + 1})
            grow(boxes_[node], boxes_[child].lower, boxes_[child].upper);
    }
}

double TriangleTree::squared_distance_to_leaf(std::size_t leaf, const Vec3d& place) const {
    double nearest = std::numeric_limits<double>::infinity();
    const std::size_t end = std::min((leaf + 1) * kLeafSize, order_.size());
    for (std::size_t i = leaf * kLeafSize; i < end; ++i)
        nearest = std::min(nearest,
                           squared_distance_to_triangle(place, Corners(mesh_, mesh_.triangles[order_[i]])));
    return nearest;
}

double TriangleTree::distance(const Vec3d& place) const {
    const auto to_box = [&](std::size_t node) {
        double sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double outside = std::max(
                {boxes_[node].lower[axis] - place[axis], place[axis] - boxes_[node].upper[axis], 0.0});
            sum += outside * outside;
        }
        return sum;
    };
    struct Node {
        std::size_t index;
        double squared_distance;  // to its box
    };
    std::array<Node, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = {1, to_box(1)};
    double nearest = std::numeric_limits<double>::infinity();
    while (depth > 0) {
        const Node node = stack[--depth];
        if (node.squared_distance >= nearest) continue;
        if (node.index >= leaves_) {
            nearest = std::min(nearest, squared_distance_to_leaf(node.index - leaves_, place));
            continue;
        }
        Node near{2 * node.index, to_box(2 * node.index)};
        Node far{2 * node.index + 1, to_box(2 * node.index + 1)};
        if (far.squared_distance < near.squared_distance) std::swap(near, far);
        stack[depth++] = far;
        stack[depth++] = near;  // first
    }
    return std::sqrt(nearest);
}

}  // namespace marrow::internal
