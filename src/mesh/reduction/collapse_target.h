/// Where the collapse of an edge would put its point, and what it would cost.
#pragma once

#include <cstddef>

#include <marrow/vector.h>

#include "quadric.h"

namespace marrow::internal {

/// The collapse of an edge.
struct CollapseTarget {
    Vec3f position;      ///< of the point
    float cost;          ///< by how much the sum of squared distances grows
    double sum, weight;  ///< of the squared distances there, and of their planes
};

/// Edges whose collapses are evaluated together.
class CollapseBatch {
  public:
    static constexpr std::size_t kMost = 64;

    std::size_t size() const { return size_; }
    void clear() { size_ = 0; }
    /// Adds an edge by the positions of its ends and their quadrics, each relative to its position.
    /// \pre there are fewer than kMost edges
    void add(const Vec3f& from, const Quadric<float>& from_quadric, const Vec3f& to,
             const Quadric<float>& to_quadric) {
        from_.set(size_, from, from_quadric);
        to_.set(size_++, to, to_quadric);
    }
    /// Finds the targets. They have the same bits on every SIMD target.
    void evaluate();
    CollapseTarget operator[](std::size_t i) const {
        return {{position[0][i], position[1][i], position[2][i]}, cost[i], sum[i], weight[i]};
    }

    struct Ends {
        float position[3][kMost];
        float xx[kMost], xy[kMost], xz[kMost], yy[kMost], yz[kMost], zz[kMost];
        float b[3][kMost];
        float c[kMost];

        void set(std::size_t i, const Vec3f& p, const Quadric<float>& q) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                position[axis][i] = p[axis];
                b[axis][i] = q.b[axis];
            }
            xx[i] = q.xx, xy[i] = q.xy, xz[i] = q.xz, yy[i] = q.yy, yz[i] = q.yz, zz[i] = q.zz;
            c[i] = q.c;
        }
    };
    // For the kernel.
    Ends from_, to_;
    float position[3][kMost], cost[kMost];
    double sum[kMost], weight[kMost];

  private:
    std::size_t size_ = 0;
};

}  // namespace marrow::internal
