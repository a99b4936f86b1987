/// Taking edges out of a mesh, cheapest first, without changing its topology.
#pragma once

#include <cstdint>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "deviation_guard.h"
#include "quadric.h"

namespace marrow::internal {

/// Collapses edges to points, in the order of the quadric error that each would leave.
///
/// An edge is only collapsed where the link condition holds (Dey, Edelsbrunner, Guha and Nekhayev 1999), so
/// that a closed, manifold mesh stays one, with the same pieces and handles; where no triangle turns over or
/// thins out; and where neither end lies on an open or non-manifold edge. The same bits every time.
class EdgeCollapse {
  public:
    /// Collapses no edge that would leave a root mean square distance above `max_error` mm to the planes that
    /// were merged, nor one that the guard, where there is one, does not accept. \pre triangles name points
    /// that are there; fewer than 2^32 / 3. The guard is one of this mesh.
    EdgeCollapse(const Mesh& mesh, double max_error, DeviationGuard* guard = nullptr);

    /// Keeps a point where it is.
    void fix(std::uint32_t point) { points_[point].fixed = true; }

    /// Collapses until `triangles` are left, or no edge can go any more. \throw Cancelled
    void reduce_to(std::size_t triangles, const Progress& progress);

    /// What is left; points and triangles in the order that they had. Without normals. `old_triangles`, where
    /// given, receives what each triangle's index was.
    Mesh mesh(std::vector<std::uint32_t>* old_triangles = nullptr) const;

  private:
    // Half-edge 3 t + k runs from corner k of triangle t to the next corner.
    using Half = std::uint32_t;
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static Half next(Half h) { return h % 3 == 2 ? h - 2 : h + 1; }
    static Half prev(Half h) { return h % 3 == 0 ? h + 2 : h - 1; }
    std::uint32_t from(Half h) const { return from_[h]; }
    std::uint32_t to(Half h) const { return from_[next(h)]; }
    bool is_alive(Half h) const { return from_[h] != kNone; }

    struct Target {
        Vec3d place;
        float error;  // mean squared
    };
    struct Entry {
        Half half;
        std::uint32_t version;  // of both ends together, when it was queued
    };

    void pair_half_edges();
    void fix_points();
    void sum_quadrics();
    Target target(Half h) const;
    std::uint32_t version(Half h) const { return points_[from(h)].version + points_[to(h)].version; }
    bool is_fixed(Half h) const { return points_[from(h)].fixed || points_[to(h)].fixed; }
    void queue(Half h, float error);
    void queue_all();
    bool pop(Entry& entry);
    bool links_meet_twice(Half h);
    bool keeps_shape(std::uint32_t point, std::uint32_t other, const Vec3d& place) const;
    bool guard_accepts(Half h, const Vec3d& place);
    bool collapse(Half h);
    template <class F>
    void for_each_outgoing(std::uint32_t point, F f) const;

    /// Two cache lines: what a collapse reads of a point lies together.
    struct Point {
        Vec3d place;  // about origin_, so that quadrics keep their digits
        Quadric quadric;
        bool fixed = false;         // takes part in no collapse
        bool changed = true;        // it or a neighbour has moved since its edges were queued
        std::uint32_t version = 0;  // counts how often the point changed
        Half outgoing = kNone;      // one of its half-edges; kNone: it has no triangle
        std::uint32_t mark = 0;     // equals last_mark_ where a search has seen it
    };

    const double max_squared_error_;
    DeviationGuard* const guard_;
    std::vector<PlacedTriangle> patch_;  // kept for its memory
    Vec3d origin_{};
    std::vector<Point> points_;
    std::vector<std::uint32_t> from_;  // kNone: its triangle is gone
    std::vector<Half> twin_;           // kNone: along an open or non-manifold edge
    std::size_t alive_;                // triangles
    std::uint32_t last_mark_ = 0;

    // Buckets by the logarithm of the error, first in, first out.
    struct Bucket {
        std::vector<Entry> entries;
        std::size_t first = 0;
    };
    std::vector<Bucket> buckets_;
    std::size_t lowest_ = 0;
};

}  // namespace marrow::internal
