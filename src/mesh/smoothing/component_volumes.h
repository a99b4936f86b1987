/// The volumes of a mesh's components before and after its points moved.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>

namespace marrow::internal {

struct ComponentVolumes {
    std::uint32_t lowest;          ///< the lowest point of the component
    double before = 0, after = 0;  ///< mm3, as precise as float
};

/// Returns the volumes of the components with triangles, ordered by their lowest points. `after` are the
/// positions that the points of `before` moved to; `lowest` has the lowest point of each point's component.
/// The result has the same bits for any number of threads and any processor.
std::vector<ComponentVolumes> component_volumes(const MeshView& before, std::span<const Vec3f> after,
                                                const Buffer<std::uint32_t>& lowest);

}  // namespace marrow::internal
