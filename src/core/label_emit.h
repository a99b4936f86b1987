/// From a label map's net to its labels' meshes.
#pragma once

#include <vector>

#include <marrow/mesh.h>

#include "frame.h"
#include "label_net.h"

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

/// Meshes with as many points and triangles as each label has, not yet written. That of `background` stays empty.
/// \throw LimitError
std::vector<Mesh> allocate_meshes(const LabelNet& net, Place background);

/// Takes the net's points into space, numbers each label's, and writes them.
void place_points(LabelNet& net, const Frame& frame, Place background, std::vector<Mesh>& meshes,
                  Stage& stage);

/// Writes the triangles. \pre place_points
void make_triangles(const LabelNet& net, bool mirrored, Place background, std::vector<Mesh>& meshes,
                    Stage& stage);

}  // namespace marrow::internal
