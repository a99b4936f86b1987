/// Measures how far one mesh is from another, in one direction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <marrow/measure.h>
#include <marrow/mesh.h>

#include "triangle_tree.h"

namespace marrow::internal {

/// A mesh, its tree, and the positions at which its distance to another mesh is measured.
class SampledMesh {
  public:
    /// The arrays of `mesh` must outlive this. Uses all threads. \pre the mesh has triangles, fewer than 2^32, whose
    /// indices are in range; samples > 0
    explicit SampledMesh(const MeshView& mesh, std::int64_t samples = DistanceOptions{}.samples);

    const MeshView& mesh() const { return mesh_; }
    const TriangleTree& tree() const { return *tree_; }

    std::size_t sample_count() const { return samples_.size(); }
    /// Samples are spread evenly over the area. Triangle t has first_sample(t) to first_sample(t + 1) - 1.
    const Vec3d& sample(std::size_t k) const { return samples_[k]; }
    std::size_t first_sample(std::size_t t) const { return first_sample_[t]; }
    /// Whether a point belongs to triangle t. Each point belongs to one of its triangles, if it has any.
    bool belongs_to(std::uint32_t point, std::uint32_t t) const { return triangle_of_[point] == t; }
    bool is_unused(std::uint32_t point) const { return triangle_of_[point] == kNone; }

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    void spread_samples(std::int64_t count);

    MeshView mesh_;
    std::optional<TriangleTree> tree_;
    std::vector<Vec3d> samples_;
    std::vector<std::size_t> first_sample_;
    std::vector<std::uint32_t> triangle_of_;
};

/// The distances of a mesh to another mesh, in mm.
struct Distances {
    std::vector<double> samples, points;

    double max() const;
    double mean() const;  ///< over the area
};

/// Measures from `from` to the mesh of the tree `to`. Reports progress from `begin` to `end`.
///
/// The distances of points are bounds: a point that is not further than another one may get a larger distance than it
/// has, but not a larger one than the other point's. So the maximum is right. \throw Cancelled
Distances distances(const SampledMesh& from, const TriangleTree& to, const Progress& progress, double begin,
                    double end);

/// Finds the samples and points of `from` that are further than `max_distance` from the mesh of the tree `to`. Returns
/// the triangle of each such sample, and each such point three times. Takes much less time than distances().
/// \throw Cancelled
std::vector<Triangle> find_further(const SampledMesh& from, const TriangleTree& to, double max_distance,
                                   const Progress& progress, double begin, double end);

/// Combines the two directions.
MeshDistance symmetric(const Distances& there, const Distances& back);

}  // namespace marrow::internal
