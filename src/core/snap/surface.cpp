// Runs slabs in parallel.
#include "surface.h"

#include <algorithm>
#include <utility>

#include "base/parallel.h"
#include "core/grid/shares.h"
#include "slab.h"

namespace marrow::internal {

namespace {

std::vector<SnapSlab> make_slabs(const EmitInput& input, const SnapExceptions& exceptions, float limit,
                                 bool normals) {
    constexpr std::int64_t kFewestSlices = 16;  // because a slab processes up to four more than these
    const auto threads = static_cast<std::int64_t>(share_count() / kSharesPerThread);
    const std::int64_t nz = input.bits.nz, slabs = threads == 1 ? 1 : 4 * threads;
    const std::int64_t slices = std::max((nz + slabs - 1) / slabs, kFewestSlices);
    std::vector<SnapSlab> result;
    for (std::int64_t z = 0; z < nz; z += slices)
        result.emplace_back(input, exceptions, limit, normals, z, std::min(z + slices, nz));
    return result;
}

}  // namespace

std::size_t make_surface(const EmitInput& input, const SnapExceptions& exceptions, float limit, bool normals,
                         const Progress& progress, SnapOutput& surface) {
    std::vector<SnapSlab> slabs = make_slabs(input, exceptions, limit, normals);
    // A single slab writes directly to the memory of the mesh.
    if (slabs.size() == 1) std::swap(slabs[0].output.mesh, surface.mesh);
    Stage stage(progress, 0, 1, static_cast<std::size_t>(input.bits.nz));
    parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) { slabs[s].run(stage); });
    if (slabs.size() == 1) {
        surface = std::move(slabs[0].output);
    } else {
        std::vector<const SnapOutput*> outputs;
        for (const SnapSlab& slab : slabs) outputs.push_back(&slab.output);
        join(outputs, surface);
    }
    std::size_t bytes = 0;
    for (const SnapSlab& slab : slabs) bytes += slab.bytes();
    return bytes;
}

void make_again(const EmitInput& input, const SnapExceptions& exceptions, float limit,
                const std::set<std::int64_t>& changed, const Progress& progress, SnapOutput& surface,
                std::vector<std::uint8_t>& layers) {
    // The points of a sample's cluster are in its slice and the one before. Triangles use the points of their
    // slice and of the next.
    for (const std::int64_t z : changed) {
        for (std::int64_t k = std::max<std::int64_t>(z - 2, 0); k <= std::min(z, input.bits.nz - 1); ++k)
            layers[static_cast<std::size_t>(k)] = 1;
    }
    const bool normals = !surface.mesh.normals.empty();
    std::vector<SnapSlab> slabs;
    std::size_t slices = 0;
    for (std::size_t begin = 0, end = 0; begin < layers.size(); begin = end + 1) {
        for (end = begin; end < layers.size() && layers[end] != 0;) ++end;
        if (end == begin) continue;
        slabs.emplace_back(input, exceptions, limit, normals, static_cast<std::int64_t>(begin),
                           static_cast<std::int64_t>(end));
        slices += end - begin;
    }
    Stage stage(progress, 0, 1, slices);
    parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) { slabs[s].run(stage); });
    std::vector<SnapPart> parts;
    for (SnapSlab& slab : slabs)
        parts.push_back({static_cast<std::size_t>(slab.begin()), std::move(slab.output)});
    replace_slices(surface, parts);
}

}  // namespace marrow::internal
