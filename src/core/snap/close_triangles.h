/// Finds the pairs of triangles of a snapped surface that could intersect.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <marrow/buffer.h>

#include "mesh/search/triangle_pyramid.h"
#include "snap_output.h"

namespace marrow::internal {

/// The triangles of a layer of cells, each with its corners side by side.
struct LayerTriangles {
    static constexpr std::size_t kSlack = 32;        ///< cells after the last triangle's
    static constexpr std::uint32_t kFloats = 3 * 4;  ///< of a triangle: three positions and numbers of points

    std::size_t count = 0;
    Buffer<std::int32_t> cells;  ///< their numbers; after the last one follow larger ones
    /// The bits of a number stand for a float.
    Buffer<float> corners;
};

/// Fills `to` with the triangles [begin, end) of a surface, which are those of a layer.
void pack_layer(const SnapOutput& surface, std::size_t begin, std::size_t end, LayerTriangles& to);

/// Pairs of triangles: where the first and the second begin in the corners of their layers.
struct LayerPairs {
    static constexpr std::size_t kSlack = 16;  ///< elements after the last pair

    std::size_t count = 0;
    Buffer<std::uint32_t> first, second;
};

/// Lists the pairs of triangles of a layer, and those with a triangle of the next layer, whose cells are the
/// same or neighbours. `cells_per_row`: as CellNumbers::per_row
void list_neighbours(const LayerTriangles& layer, const LayerTriangles& next, std::uint64_t cells_per_row,
                     LayerPairs& pairs, LayerPairs& pairs_to_next);

/// Appends the indices in their layers of those of the pairs that may intersect: they have at most one point
/// in common, and no plane separates them clearly. `most_apart`: the most that coordinates of two triangles
/// differ by
void find_close_pairs(const LayerTriangles& layer, const LayerTriangles& layer_of_second,
                      const LayerPairs& pairs, float most_apart, std::vector<TrianglePair>& close);

}  // namespace marrow::internal
