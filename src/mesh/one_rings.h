/// The neighbours of each point of a mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// The points at the other ends of each point's edges, in the order of the triangles.
class OneRings {
  public:
    /// Takes linear time. \pre indices are in range
    explicit OneRings(const MeshView& mesh);

    std::size_t size() const { return regular_.size(); }
    /// Whether all edges of a point are manifold. Only then its neighbours are complete and listed once each.
    bool is_regular(std::size_t p) const { return regular_[p] != 0; }
    std::span<const std::uint32_t> of(std::size_t p) const {
        return {neighbours_.data() + start_[p], neighbours_.data() + start_[p + 1]};
    }

  private:
    std::vector<std::size_t> start_;
    Buffer<std::uint32_t> neighbours_;
    Buffer<std::uint8_t> regular_;
};

}  // namespace marrow::internal
