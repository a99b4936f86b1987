/// Taking edges out of a mesh, cheapest first, without changing its topology.
#pragma once

#include <array>
#include <cstddef>
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
    /// that are there; fewer than 2^30. The guard is one of this mesh.
    EdgeCollapse(const Mesh& mesh, double max_error, DeviationGuard* guard = nullptr);

    /// Keeps a point where it is.
    void fix(std::uint32_t point) { points_[point].fixed = true; }

    /// Collapses until `triangles` are left, or no edge can go any more. \throw Cancelled
    void reduce_to(std::size_t triangles, const Progress& progress);

    /// What is left; points and triangles in the order that they had. Without normals. `old_triangles`, where
    /// given, receives what each triangle's index was.
    Mesh mesh(std::vector<std::uint32_t>* old_triangles = nullptr) const;

  private:
    // Half-edge 4 t + k runs from corner k of triangle t to the next corner.
    using Half = std::uint32_t;
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static Half next(Half h) { return h % 4 == 2 ? h - 2 : h + 1; }
    static Half prev(Half h) { return h % 4 == 0 ? h + 2 : h - 1; }
    std::uint32_t from(Half h) const { return faces_[h / 4].from[h % 4]; }
    std::uint32_t to(Half h) const { return from(next(h)); }
    Half twin(Half h) const { return faces_[h / 4].twin[h % 4]; }
    bool is_alive(Half h) const { return faces_[h / 4].from[0] != kNone; }
    bool is_queued(Half h) const { return faces_[h / 4].queued >> h % 4 & 1; }

    /// A triangle: half a cache line.
    struct Face {
        std::array<std::uint32_t, 3> from;  // its corners; kNone: it is gone
        std::array<Half, 3> twin;           // kNone: along an open or non-manifold edge
        std::uint64_t queued = 0;           // bit k: half-edge k has an entry
    };
    /// Two cache lines; in the first, what a collapse reads of the points around.
    struct Point {
        Vec3d place;                // about origin_, so that quadrics keep their digits
        std::uint32_t version = 0;  // counts how often the point changed
        Half outgoing = kNone;      // one of its half-edges; kNone: it has no triangle
        bool fixed = false;         // takes part in no collapse
        bool changed = true;        // it or a neighbour has moved since its edges were queued
        Quadric quadric;
    };
    static constexpr std::size_t kMostNeighbours = 32;
    /// The points around a point, and its triangles' normals, as long as twice their area: triangle k has points k and k + 1.
    struct Ring {
        std::size_t size = 0;
        std::array<std::uint32_t, kMostNeighbours> points;
        std::array<Vec3d, kMostNeighbours> normals;
        Vec3d normal;  // their sum

        std::size_t after(std::size_t k) const { return k + 1 == size ? 0 : k + 1; }
    };
    struct Target {
        Vec3d place;
        float error;  // mean squared
    };
    struct Entry {
        Half half;
        std::uint32_t version;  // of both ends together, when it was queued
    };
    struct Bucket {  // what is there when its turn comes by place, what comes then first in, first out
        std::vector<Entry> entries;
        std::size_t first = 0;
    };

    void pair_half_edges();
    void pair(Half a, Half b) {
        faces_[a / 4].twin[a % 4] = b;
        faces_[b / 4].twin[b % 4] = a;
    }
    void fix_points();
    void sum_quadrics();
    Target target(Half h) const;
    std::uint32_t version(Half h) const { return points_[from(h)].version + points_[to(h)].version; }
    bool is_fixed(Half h) const { return points_[from(h)].fixed || points_[to(h)].fixed; }
    void queue(Half h, float error);
    void queue_all();
    Half pop();
    void sort_by_place(std::vector<Entry>& entries);
    void fetch_soon(const Bucket& bucket) const;
    bool find_ring(std::uint32_t point, Ring& ring) const;
    void find_normals(std::uint32_t point, Ring& ring) const;
    bool links_meet_twice(Half h);
    bool keeps_shape(const Ring& ring, std::uint32_t point, std::uint32_t other, const Vec3d& place) const;
    bool guard_accepts(Half h, const Vec3d& place);
    bool collapse(Half h);
    template <class F>
    void for_each_outgoing(std::uint32_t point, F f) const;

    const double max_squared_error_;
    DeviationGuard* const guard_;
    std::vector<PlacedTriangle> patch_;  // kept for its memory
    Vec3d origin_{};
    Buffer<Point> points_;
    Buffer<Face> faces_;
    std::size_t alive_;         // of them
    Ring from_ring_, to_ring_;  // of the edge that is tried

    std::vector<Bucket> buckets_;  // by the logarithm of the error
    std::size_t lowest_ = 0;
    std::vector<Entry> sorted_;  // kept for its memory
};

}  // namespace marrow::internal
