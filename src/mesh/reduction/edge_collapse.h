/// Collapses the edges of a mesh, cheapest first, without changing its topology.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "base/parallel.h"
#include "collapse_guard.h"
#include "collapse_ring.h"
#include "collapse_target.h"
#include "mesh/connectivity/point_bands.h"
#include "quadric.h"

namespace marrow::internal {

/// Collapses edges to points. Next is always roughly the edge whose collapse adds the least to the squared
/// distance from the original planes, summed over their area.
///
/// An edge is collapsed only if the link condition holds (Dey, Edelsbrunner, Guha and Nekhayev 1999): so a
/// closed, manifold mesh stays closed and manifold, with the same components and handles. No triangle may
/// flip or become much thinner, and neither end may be on an open or non-manifold edge. The result has the
/// same bits every time.
///
/// Large meshes are divided into regions, which threads collapse at the same time. The regions, and what
/// happens in them, do not depend on the threads.
///
/// A log of the collapses allows to undo some of them later, where the result turns out to be bad. A collapse
/// can be undone once all later ones around its point are (Hoppe 1996, Xia and Varshney 1996). Or else a
/// guard looks at each collapse before it is done.
class EdgeCollapse {
  public:
    /// \pre indices are in range; fewer than 2^30 triangles
    explicit EdgeCollapse(const Mesh& mesh)
        : EdgeCollapse(mesh, std::numeric_limits<double>::infinity(), nullptr) {}
    /// Collapses no edge that would leave a root mean square distance above `max_error` mm to the merged
    /// planes, and no edge that the guard rejects, if there is one. Several threads ask this guard.
    /// \pre while there is a guard, no edge is collapsed after one was undone
    EdgeCollapse(const Mesh& mesh, double max_error, CollapseGuard* guard);

    /// Collapses until `triangles` are left, or until no edge can be collapsed. It may be called again with
    /// the same number after undo(). \throw Cancelled
    void reduce_to(std::size_t triangles, const Progress& progress);

    /// From now on, collapses no edge that the guard rejects, which only one thread asks. Points of
    /// undone collapses take part again.
    void set_guard(CollapseGuard* guard);

    /// Undoes up to `count` collapses that made the triangles that have these corners, the latest first, and
    /// the later ones around them. Points are as in the original mesh. The points of these collapses take
    /// part in none any more; those of the later ones around them do. Returns how many collapses it undid.
    /// \pre no corner is merged into another point
    std::size_t undo(std::span<const std::uint32_t> corners, std::size_t count);

    std::size_t triangles() const { return alive_; }

    /// A reduced mesh without normals. Points and triangles keep their order.
    struct Result {
        Mesh mesh;
        std::vector<std::uint32_t> old_points;     ///< the indices of the points in the original mesh
        std::vector<std::uint32_t> old_triangles;  ///< the same for triangles
        std::vector<std::uint32_t> changed;  ///< the triangles at points that changed since the last call
    };
    Result result();

    /// The point that each point of the original mesh was merged into, or the point itself.
    Buffer<std::uint32_t> merged_into() const;

  private:
    // Half-edge 4 t + k runs from corner k of triangle t to the next corner.
    using Half = std::uint32_t;
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    static Half next(Half h) { return h % 4 == 2 ? h - 2 : h + 1; }
    static Half prev(Half h) { return h % 4 == 0 ? h + 2 : h - 1; }
    std::uint32_t from(Half h) const { return faces_[h / 4].from[h % 4]; }
    std::uint32_t to(Half h) const { return from(next(h)); }
    Half twin(Half h) const { return faces_[h / 4].twin[h % 4]; }
    bool is_alive(Half h) const { return faces_[h / 4].alive; }
    bool is_queued(Half h) const { return faces_[h / 4].queued >> h % 4 & 1; }

    // A triangle. It takes half a cache line.
    struct Face {
        std::array<std::uint32_t, 3> from;  // its corners
        std::array<Half, 3> twin;           // kNone: along an open or non-manifold edge
        std::uint32_t queued = 0;           // bit k: half-edge k has an entry in the queue
        bool alive = true;                  // false: a collapse has removed it; its corners and twins stay
    };
    static constexpr std::uint8_t kHighDegree = 255;  // or more triangles
    // A point. It takes one cache line.
    struct Point {
        Vec3f position;
        std::uint32_t latest = 0;  // the last collapse that merged a point into this one; 0: none
        Half outgoing = kNone;     // one of its half-edges; kNone: it has no triangle
        std::uint16_t region = 0;
        std::uint8_t degree = kHighDegree;  // the number of its triangles, if it is not open
        bool open : 1 = false;              // its triangles do not form one closed fan
        bool fixed : 1 = false;             // takes part in no collapse, as all open points
        bool changed : 1 = true;            // the point or a neighbour has moved since its edges were queued
        bool is_new : 1 = false;            // a collapse or its undoing has changed it since the last result
        Quadric<float> quadric{};  // of the planes of the points that it replaces, relative to its position
    };
    struct Entry {
        Half half;
        std::uint32_t version;  // the sum of both ends' latest collapses when the entry was queued
    };
    // What the evaluation of a collapse depends on.
    struct Ends {
        std::uint32_t from, to, latest_from, latest_to;
        bool operator==(const Ends&) const = default;
    };
    // Entries of a bucket whose collapses were evaluated, unless they had become impossible.
    struct Evaluated {
        std::size_t bucket = 0, begin = 0, end = 0;
        CollapseBatch batch;
        static constexpr std::uint8_t kNowhere = 255;
        std::array<std::uint8_t, CollapseBatch::kMost> place;  // of each entry in the batch
        std::array<Ends, CollapseBatch::kMost> ends;           // of each edge in the batch
    };
    // An edge that is next to be collapsed.
    struct Due {
        Half half;
        CollapseTarget target;
    };
    // A collapse merges the end of a half-edge into its beginning.
    struct Collapse {
        Half half;
        std::uint32_t removed;  // the point at the end; kNone: the collapse was undone
        std::uint32_t time;     // larger than that of all collapses around it before
        Point kept;             // the point at the beginning, before the collapse
    };
    // Entries of similar costs, in the order in which they were queued.
    struct Bucket {
        std::vector<Entry> entries;
        std::size_t first = 0;

        std::size_t left() const { return entries.size() - first; }
    };
    // The edges between the points of a region, and what the thread that collapses them needs. Region 0 has
    // the other edges. Its points are those that edges between regions were collapsed to.
    //
    // A thread collapses an edge of its region if all neighbours of both ends are points of the region too.
    // So it changes only triangles with three corners in the region, and of others the twins and queue
    // entries of edges in the region. Other threads do not look at these, because they stay at the triangles
    // around points of their region and of region 0. Points change only to region 0, and not meanwhile, so no
    // edge moves from one queue into another region.
    struct Region {
        explicit Region(std::uint16_t n);
        void take(Region& other);

        const std::uint16_t number;
        std::vector<Bucket> buckets;  // by the logarithm of the cost
        std::size_t lowest;           // all buckets below are empty
        std::vector<std::pair<std::size_t, Entry>>
            outside;                       // for region 0: edges of the region's border, after their buckets
        Buffer<Collapse> log;              // of the collapses in this region
        std::uint32_t first_collapse = 0;  // the number of the first one
        std::uint32_t time = 0;            // of the last one
        // For the edge that is tried.
        Ring from_ring, to_ring;
        std::vector<Half> opposite;
        std::vector<PatchTriangle> patch;
    };

    void pair_half_edges(const MeshView& mesh, const PointBands& bands);
    void pair(Half a, Half b) {
        faces_[a / 4].twin[a % 4] = b;
        faces_[b / 4].twin[b % 4] = a;
    }
    void fix_points(const MeshView& mesh, const PointBands& bands);
    void sum_quadrics(const MeshView& mesh, const PointBands& bands);
    void divide(const Mesh& mesh);
    Vec3d position(std::uint32_t point) const { return to_double(points_[point].position); }
    Quadric<double> merged_quadric(std::uint32_t a, std::uint32_t b) const;
    void add_to(CollapseBatch& batch, Half h) const;
    CollapseTarget target(Half h) const;
    bool is_allowed(const CollapseTarget& target) const {
        return target.sum <= max_squared_error_ * target.weight;
    }
    std::uint32_t version(Half h) const { return points_[from(h)].latest + points_[to(h)].latest; }
    Ends ends(Half h) const {
        const std::uint32_t a = from(h), b = to(h);
        return {a, b, points_[a].latest, points_[b].latest};
    }
    bool is_fixed(Half h) const { return points_[from(h)].fixed || points_[to(h)].fixed; }
    bool may_collapse(Half h) const { return is_alive(h) && h < twin(h) && !is_fixed(h); }
    Region& region_of(Half h);
    Collapse& logged(std::uint32_t collapse);
    std::uint32_t later_of(std::uint32_t a, std::uint32_t b);

    bool has_queued() const;
    void queue(Region& region, Half h, std::size_t bucket);
    static void append(Region& region, Entry entry, std::size_t bucket);
    void queue_all();
    void evaluate(const Bucket& bucket, Evaluated& evaluated) const;
    bool pop(Region& region, std::size_t end, Evaluated& evaluated, Due& due);
    bool find_ring(Half first, Ring& ring) const;
    bool is_inside(const Region& region) const;
    bool meets_link_condition(Half h, const Region& region) const;
    bool has_few_triangles(std::uint32_t point) const;
    bool inverts_component(Half h, const Vec3d& there, Region& region) const;
    bool guard_accepts(Half h, const Vec3d& position, std::vector<PatchTriangle>& patch);
    bool collapse(const Due& due, Region& region);
    void queue_around(std::uint32_t point, Region& region);
    std::size_t collapse_up_to(std::size_t most, std::size_t end, Region& region, Stage& stage);
    void collapse_regions(std::size_t triangles, Stage& stage);
    std::size_t undo(std::uint32_t collapse);
    void undo_one(Collapse& collapse);
    template <class F>
    void for_each_outgoing(std::uint32_t point, F f) const;

    const double max_squared_error_;
    CollapseGuard* guard_;
    Buffer<Point> points_;
    Buffer<Face> faces_;
    std::size_t alive_;  // the number of faces that are left
    std::vector<Region> regions_;
    // Whether regions are collapsed on their own: not after an undo, nor with a
    // guard that only one thread may ask.
    bool parallel_ = false;
    // Whether edges inside of regions are queued there, and not in region 0.
    bool divided_ = false;
};

// \pre `point` is not open
template <class F>
void EdgeCollapse::for_each_outgoing(std::uint32_t point, F f) const {
    const Half first = points_[point].outgoing;
    Half h = first;
    do {
        f(h);
        h = twin(prev(h));
    } while (h != first);
}

}  // namespace marrow::internal
