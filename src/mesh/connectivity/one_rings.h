/// The neighbours of each point of a mesh.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

#include "point_bands.h"

namespace marrow::internal {

/// The points at the other ends of each point's edges. In chunks of successive points, they are also listed
/// by the number of their neighbours, because loops whose length changes at random are slow.
class OneRings {
  public:
    static constexpr std::size_t kChunk = PointBands::kChunk;  ///< points
    static constexpr std::size_t kMostInFan = 16;              ///< triangles; points with more are no fans

    /// Takes nearly linear time, on all threads. \pre indices are in range
    explicit OneRings(const MeshView& mesh);

    std::size_t size() const { return kinds_.size(); }
    /// Whether all edges of a point are manifold. Only then its neighbours are complete and listed once each.
    bool is_regular(std::size_t p) const { return kinds_[p] != Kind::kIrregular; }
    /// Whether the triangles of a point are a single closed fan, of kMostInFan at most. Then each runs from
    /// the point to a neighbour and on to the next one; the last neighbour is followed by the first.
    bool is_fan(std::size_t p) const { return kinds_[p] == Kind::kFan; }
    std::span<const std::uint32_t> of(std::size_t p) const {
        return {neighbours_.data() + start_[p], count_[p]};
    }

    /// Calls f(p) for each point that is not regular, in ascending order.
    template <class F>
    void for_each_irregular(const F& f) const {
        for (std::size_t chunk = 0; chunk < chunks(); ++chunk) {
            for (const std::uint32_t p : listed(chunk, 0)) {
                if (!is_regular(p)) f(p);
            }
        }
    }

    std::size_t chunks() const { return chunks_.size(); }
    /// The fans of a chunk with this number of neighbours, from 1 to kMostInFan; with 0, its other points.
    /// The neighbours of successive points in a list follow each other in memory.
    std::span<const std::uint32_t> listed(std::size_t chunk, std::size_t neighbours) const {
        const std::uint32_t* const points = listed_.data() + chunk * kChunk;
        return {points + chunks_[chunk].begin[neighbours], points + chunks_[chunk].begin[neighbours + 1]};
    }
    /// The lowest and the highest point among those of a chunk and their neighbours.
    Reach reach(std::size_t chunk) const { return chunks_[chunk].reach; }

    /// A triangle at a point. It runs from one neighbour to the point, and on to the next one.
    struct Corner {
        std::uint32_t next, before;
    };

  private:
    enum class Kind : std::uint8_t { kIrregular, kRegular, kFan };
    struct Chunk {
        std::array<std::uint16_t, kMostInFan + 2> begin;
        Reach reach;
    };

    // The corners at the points of a band, and the first one of each point.
    struct Lists {
        Buffer<Corner> corners;
        std::vector<std::size_t> first;
    };

    // Lists the points of a chunk, whose rings begin at `first_ring`. `first` has the first corner of each of
    // its points, and the end of the last one.
    void list_chunk(const Corner* corners, const std::size_t* first, std::size_t first_ring,
                    std::size_t chunk);
    // Moves points that turned out to be no fans to list 0, and the rings of the fans up to their `end`, so
    // that no gap is left between them.
    void move_to_others(std::size_t chunk, const std::array<std::uint8_t, kChunk>& lists, std::uint32_t* end);

    Buffer<std::size_t> start_;
    Buffer<std::uint32_t> count_, neighbours_, listed_;
    Buffer<Kind> kinds_;
    Buffer<Chunk> chunks_;
};

}  // namespace marrow::internal
