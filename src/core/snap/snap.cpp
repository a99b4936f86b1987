// Snapping merges points after SnapMC (Raman and Wenger 2008), with two differences. The merged point is at
// the centre of its cluster instead of at the sample, so that the surface stays where it is. And the samples
// around a cluster show in advance that merging leaves a manifold of the same topology.
//
// A slab processes its slices in order:
//
// 1. Make the points of a slice and measure them: which end of its edge is nearer to each, and how far away
//    it is.
// 2. Merge the points around each sample of the slice, or move them away from the sample.
// 3. Write the remaining points of the slice before to the output. No later slice changes them.
// 4. Make the triangles between that slice and the one before it, except those that collapsed.
//
// The slabs run in parallel. Each processes a few slices more than it outputs, so that neighbouring slabs
// decide alike. Then cap triangles are widened. Where the result passes through itself, the slices there are
// made again, with less snapping around their samples, and take the place of the others.
#include "snap.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <marrow/error.h>

#include "base/progress.h"
#include "find_intersections.h"
#include "relax_caps.h"
#include "surface.h"

namespace marrow::internal {

namespace {

// Widens the caps of a surface, and marks the layers of triangles whose corners are not where they were after
// caps were widened the last time.
void widen_caps(const EmitInput& input, const SnapExceptions& exceptions, double limit, SnapOutput& surface,
                std::vector<std::uint8_t>& layers) {
    const auto for_each_corner = [&](const auto& f) {
        for (CapTriangle& cap : surface.caps) {
            for (std::size_t c = 0; c < 3; ++c) f(cap.triangle[c], cap.before[c], cap.after[c]);
        }
    };
    const Buffer<Vec3f>& points = surface.mesh.points;
    for_each_corner([&](std::uint32_t p, Vec3f& before, const Vec3f&) { before = points[p]; });
    if (exceptions.forbid_any_widening()) {
        std::vector<CapTriangle> allowed = surface.caps;
        std::erase_if(allowed, [&](const CapTriangle& cap) {
            return std::any_of(cap.before.begin(), cap.before.end(),
                               [&](const Vec3f& p) { return exceptions.forbid_widening(p); });
        });
        relax_caps(input, limit, allowed, surface.mesh);
    } else {
        relax_caps(input, limit, surface.caps, surface.mesh);
    }
    for_each_corner([&](std::uint32_t p, const Vec3f&, Vec3f& after) {
        if (std::exchange(after, points[p]) == points[p]) return;
        const auto next =
            std::upper_bound(surface.starts.begin(), surface.starts.end(), p,
                             [](std::uint32_t point, const SliceStart& s) { return point < s.point; });
        const auto z = static_cast<std::size_t>(next - surface.starts.begin()) - 1;
        layers[z] = layers[z > 0 ? z - 1 : 0] = 1;
    });
}

// Moves the corners of caps back to where they were before caps were widened.
void restore_caps(SnapOutput& surface) {
    for (const CapTriangle& cap : surface.caps) {
        for (std::size_t c = 0; c < 3; ++c) surface.mesh.points[cap.triangle[c]] = cap.before[c];
    }
}

// Marks the layers beside those that are marked, too. Their triangles share points with these, and such a
// point is no longer moved if it was a corner of a cap that is gone.
void mark_neighbours(std::vector<std::uint8_t>& layers) {
    const std::vector<std::uint8_t> marked = layers;
    for (std::size_t z = 0; z < marked.size(); ++z) {
        if (marked[z] == 0) continue;
        if (z > 0) layers[z - 1] = 1;
        if (z + 1 < layers.size()) layers[z + 1] = 1;
    }
}

}  // namespace

// Without snapping, the surface does not pass through itself, unless float32 rounds its points too much. So
// parts of it are made again, with more and more exceptions around the places where it does.
std::size_t snap(const EmitInput& input, double limit, bool normals, const Progress& progress, Mesh& mesh) {
    if (input.triangles.total() >> 32)
        throw LimitError("snap: the surface has 2^32 triangles or more; crop or coarsen the volume");
    const auto limit_in_edges = static_cast<float>(limit);
    const Progress progress_again = sub_progress(progress, 1, 1);
    SnapExceptions exceptions(input);
    SnapOutput surface;
    std::swap(surface.mesh, mesh);
    const std::size_t bytes =
        make_surface(input, exceptions, limit_in_edges, normals, sub_progress(progress, 0, 0.5), surface);
    std::vector<std::uint8_t> layers(surface.slices(), 1);
    widen_caps(input, exceptions, limit, surface, layers);
    std::vector<TrianglePair> pairs = find_intersections(input, limit, surface, layers, progress, 0.5, 1);
    const auto are_exhausted = [&](const TrianglePair& pair) {
        return exceptions.are_exhausted(surface.mesh, surface.mesh.triangles[pair[0]]) &&
               exceptions.are_exhausted(surface.mesh, surface.mesh.triangles[pair[1]]);
    };
    for (std::int64_t round = 0; !pairs.empty(); ++round) {
        if (std::any_of(pairs.begin(), pairs.end(), are_exhausted))
            throw GeometryError(
                "snap: float32 rounds the coordinates of the surface so much that it passes through itself, "
                "because they are too large for the spacing; move the origin of the volume closer to 0");
        for (const auto& [s, t] : pairs) {
            exceptions.add(surface.mesh, surface.mesh.triangles[s], round / 2);
            // Less snapping on one side is often enough.
            if (round > 0) exceptions.add(surface.mesh, surface.mesh.triangles[t], round / 2);
        }
        restore_caps(surface);
        std::fill(layers.begin(), layers.end(), std::uint8_t{0});
        make_again(input, exceptions, limit_in_edges, exceptions.take_changed_slices(), progress_again,
                   surface, layers);
        mark_neighbours(layers);
        widen_caps(input, exceptions, limit, surface, layers);
        pairs = find_intersections(input, limit, surface, layers, progress, 1, 1);
    }
    report_progress(progress, 1);
    std::swap(surface.mesh, mesh);
    return bytes + surface.bytes();
}

}  // namespace marrow::internal
