/// What goes into labels' meshes, and who writes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <marrow/mesh.h>

#include "core/grid/index_to_physical.h"
#include "surface_net.h"

namespace marrow::internal {

/// Where a label's next point goes. Steps of 0: the background's, which are all dropped.
struct PointWriter {
    Vec3f* points;
    std::uint32_t next, step;

    /// Returns the point's number.
    std::uint32_t write(const NetPoint& point) {
        const std::uint32_t number = next;
        points[number] = {point.at[0], point.at[1], point.at[2]};
        next += step;
        return number;
    }
};

/// A quad's points in a label's mesh.
using Corners = std::uint32_t __attribute__((vector_size(16)));

/// Where a label's next triangle goes. Steps of 0: the background's, which are all dropped: a branch would be mispredicted at
/// every other border.
struct TriangleWriter {
    Triangle* next;
    std::size_t step;

    /// Both triangles of a quad.
    void add(Corners q) {
        put(__builtin_shufflevector(q, q, 0, 1, 2, 0), __builtin_shufflevector(q, q, 2, 3, 2, 3));
    }
    /// Of a quad turned over.
    void add_turned(Corners q) {
        put(__builtin_shufflevector(q, q, 0, 3, 2, 0), __builtin_shufflevector(q, q, 2, 1, 2, 1));
    }
    void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        next[0] = {a, b, c};
        next += step;
    }

  private:
    void put(Corners four, Corners two) {
        char* const to = reinterpret_cast<char*>(next);
        next += 2 * step;
        std::memcpy(to, &four, 16);
        std::memcpy(to + 16, &two, 8);
    }
};

/// Makes the net's corners of a piece: takes its points into space, numbers each label's, and writes them.
void place_points(LabelNet& net, const IndexToPhysical& frame, std::size_t piece, PointWriter* writers);

/// Writes the patches of the edges in some slices of samples, in the order of slices. \pre the corners of cells in these slices,
/// and in the one before them, are made
void make_patches(const LabelNet& net, bool mirrored, std::int64_t begin, std::int64_t end,
                  TriangleWriter* writers);

}  // namespace marrow::internal
