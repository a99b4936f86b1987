/// The neighbours of each point of a mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

namespace marrow::internal {

/// The points at the other ends of each point's edges. Most points have as many neighbours as their successors
/// only by chance, and a processor guesses such loops wrongly. So points are also listed by the number of their
/// neighbours, in chunks of successive points.
class OneRings {
  public:
    static constexpr std::size_t kChunk = 512;  ///< points
    static constexpr std::size_t kMaxListed = 12;

    /// Takes linear time, on all threads. \pre indices are in range
    explicit OneRings(const MeshView& mesh);

    std::size_t size() const { return kinds_.size(); }
    /// Whether all edges of a point are manifold. Only then its neighbours are complete and listed once each.
    bool is_regular(std::size_t p) const { return kinds_[p] != Kind::kIrregular; }
    /// Whether the triangles of a point are a single closed fan. Then they run from the point to a neighbour,
    /// to the next one in the list, and from the last one to the first.
    bool is_fan(std::size_t p) const { return kinds_[p] == Kind::kFan; }
    std::span<const std::uint32_t> of(std::size_t p) const {
        return {neighbours_.data() + start_[p], neighbours_.data() + start_[p + 1]};
    }

    std::size_t chunks() const { return chunks_.size(); }
    /// The fans of a chunk with this number of neighbours, from 1 to kMaxListed; with 0, its other points.
    std::span<const std::uint32_t> listed(std::size_t chunk, std::size_t neighbours) const {
        const std::uint32_t* const points = listed_.data() + chunk * kChunk;
        return {points + chunks_[chunk].begin[neighbours], points + chunks_[chunk].begin[neighbours + 1]};
    }
    /// The lowest and the highest point among those of a chunk and their neighbours.
    std::array<std::uint32_t, 2> reach(std::size_t chunk) const { return chunks_[chunk].reach; }

  private:
    enum class Kind : std::uint8_t { kIrregular, kRegular, kFan };
    struct Chunk {
        std::array<std::uint16_t, kMaxListed + 2> begin;
        std::array<std::uint32_t, 2> reach;
    };
    struct Corner;

    void list_chunk(const Corner* corners, std::size_t chunk);

    Buffer<std::size_t> start_;
    Buffer<std::uint32_t> neighbours_, listed_;
    Buffer<Kind> kinds_;
    Buffer<Chunk> chunks_;
};

}  // namespace marrow::internal
