/// Measures how far one mesh is from another, in one direction.
#pragma once

#include <hwy/cache_control.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// A mesh, its tree, and the positions at which its distance to another mesh is measured: samples, which are
/// spread evenly over its area, and its points.
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
    /// The points without triangles.
    const std::vector<std::uint32_t>& unused() const { return unused_; }

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
    std::vector<std::uint32_t> unused_;
};

/// The distance of a mesh to another mesh, in mm.
struct Distances {
    double mean = 0;  ///< over the area
    double max = 0;   ///< of all samples and points
    /// Where it is further than wanted: the triangle of each such sample, and each such point three times.
    std::vector<Triangle> further;
};

/// Measures from `from` to the mesh of the tree `to`, and lists what is further than `max_distance`. Reports
/// progress from `begin` to `end`. \throw Cancelled
Distances distances(const SampledMesh& from, const TriangleTree& to, double max_distance,
                    const Progress& progress, double begin, double end);

/// Lists the samples and points of the triangles `wanted` that are further than `max_distance`, as
/// distances() does. Takes less time. \throw Cancelled
std::vector<Triangle> find_further(const SampledMesh& from, const std::vector<bool>& wanted,
                                   const TriangleTree& to, double max_distance, const Progress& progress,
                                   double begin, double end);

/// Combines the two directions.
MeshDistance symmetric(const Distances& there, const Distances& back);

}  // namespace marrow::internal
