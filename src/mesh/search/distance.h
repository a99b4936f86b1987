/// Measures how far one mesh is from another, in one direction.
#pragma once

#include <hwy/cache_control.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// A mesh, its tree, and the positions at which its distance to another mesh is measured: samples, which are
/// spread evenly over its area, and the points of its triangles.
class SampledMesh {
  public:
    /// The arrays of `mesh` must outlive this. Uses all threads. \pre the mesh has triangles, fewer than
    /// 2^32, whose indices are in range; samples > 0
    explicit SampledMesh(const MeshView& mesh, std::int64_t samples = DistanceOptions{}.samples);

    const MeshView& mesh() const { return mesh_; }
    const TriangleTree& tree() const { return *tree_; }

    /// Triangle t has the samples first_sample(t) to first_sample(t + 1) - 1.
    std::size_t first_sample(std::size_t t) const { return positions_[t].first_sample; }
    std::size_t sample_count() const { return positions_.back().first_sample; }
    /// Whether the point at this corner belongs to triangle t. Each point belongs to one of its triangles.
    bool owns_corner(std::uint32_t t, std::size_t corner) const { return positions_[t].owned >> corner & 1; }
    /// Fetches what the above need of triangle t.
    void prefetch(std::uint32_t t) const { hwy::Prefetch(&positions_[t]); }

  private:
    void spread_samples(std::int64_t count);
    void assign_points();

    MeshView mesh_;
    std::optional<TriangleTree> tree_;
    struct OfTriangle {
        std::uint64_t first_sample : 61;
        std::uint64_t owned : 3;  // bits of corners
    };
    Buffer<OfTriangle> positions_;  // after those of all triangles, the number of samples
};

/// The distances of the positions of a mesh to another mesh, in mm.
class Distances {
  public:
    /// Measures from `from` to the mesh of the tree `to`. Reports progress from `begin` to `end`.
    /// \throw Cancelled
    void measure(const SampledMesh& from, const TriangleTree& to, const Progress& progress, double begin,
                 double end);

    /// A mesh that changes in places. Each triangle has a name, which it keeps.
    struct Changing {
        std::span<const std::uint32_t> names;  ///< of the triangles; empty: their indices
        /// By name: whether since the last measurement the triangle may have changed, or the part of the
        /// other mesh that is within `max_distance` of it.
        const std::vector<bool>& stale;
    };
    /// The same, but measures only what may be another distance than last time. Returns what is further than
    /// `max_distance`: the triangle of each such sample, and each such point three times.
    /// \pre at first everything is stale, and `max_distance` is always the same
    std::vector<Triangle> measure_again(const SampledMesh& from, const Changing& changing,
                                        const TriangleTree& to, double max_distance, const Progress& progress,
                                        double begin, double end);

    /// Allocates the memory for this many samples, before much time is spent. \throw LimitError
    void reserve(std::int64_t samples);

    double mean() const;                 ///< over the area
    double max() const { return max_; }  ///< of all samples and points

  private:
    struct Wanted;
    Wanted find_wanted(const SampledMesh& from, const Changing& changing, double max_distance);
    template <class F>
    void measure_positions(const SampledMesh& from, const Wanted& wanted, const TriangleTree& to,
                           double max_distance, const Progress& progress, double begin, double end,
                           const F& f);

    std::vector<double> of_samples_;
    double max_ = 0;
    // To measure again: the names of the samples' triangles, and by name, how far the points of a triangle
    // are at most. It is exact for the furthest point only.
    std::vector<std::uint32_t> names_;
    std::vector<double> of_points_;
};

/// Combines the two directions.
MeshDistance symmetric(const Distances& there, const Distances& back);

}  // namespace marrow::internal
