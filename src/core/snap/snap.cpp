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
// Then cap triangles are widened. Where the result passes through itself, all of this is repeated with
// less snapping around the samples there. The slabs run in parallel. Each processes a few slices more than it
// outputs, so that neighbouring slabs decide alike.
#include "snap.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "core/grid/shares.h"
#include "mesh/intersections/self_intersections.h"
#include "relax_caps.h"
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

// Copies the output of the slabs to the mesh. Returns their cap triangles.
std::vector<CapTriangle> gather(const std::vector<SnapSlab>& slabs, bool normals, Mesh& mesh) {
    std::vector<CapTriangle> caps;
    std::vector<std::uint64_t> first_point{0}, first_triangle{0};
    const auto shifted = [](Triangle triangle, std::uint64_t by) {
        for (std::uint32_t& p : triangle) p += static_cast<std::uint32_t>(by);
        return triangle;
    };
    for (const SnapSlab& slab : slabs) {
        for (const CapTriangle& cap : slab.caps)
            caps.push_back({shifted(cap.triangle, first_point.back()), cap.moved});
        first_point.push_back(first_point.back() + slab.points.size());
        first_triangle.push_back(first_triangle.back() + slab.triangles.size());
    }
    mesh.points.resize(checked_size(first_point.back(), sizeof(Vec3f)));
    mesh.normals.resize(normals ? mesh.points.size() : 0);
    mesh.triangles.resize(checked_size(first_triangle.back(), sizeof(Triangle)));
    parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) {
        const SnapSlab& slab = slabs[s];
        const auto point = static_cast<std::ptrdiff_t>(first_point[s]),
                   triangle = static_cast<std::ptrdiff_t>(first_triangle[s]);
        std::copy(slab.points.begin(), slab.points.end(), mesh.points.begin() + point);
        if (normals) std::copy(slab.normals.begin(), slab.normals.end(), mesh.normals.begin() + point);
        std::transform(slab.triangles.begin(), slab.triangles.end(), mesh.triangles.begin() + triangle,
                       [&](const Triangle& t) { return shifted(t, first_point[s]); });
    });
    return caps;
}

std::size_t snap_once(const EmitInput& input, const SnapExceptions& exceptions, double limit, bool normals,
                      const Progress& progress, Mesh& mesh) {
    std::vector<SnapSlab> slabs = make_slabs(input, exceptions, static_cast<float>(limit), normals);
    const auto swap_with_mesh = [&](SnapSlab& slab) {
        slab.points.swap(mesh.points);
        slab.normals.swap(mesh.normals);
        slab.triangles.swap(mesh.triangles);
    };
    // A single slab writes directly to the memory of the mesh.
    if (slabs.size() == 1) swap_with_mesh(slabs[0]);
    Stage stage(progress, 0, 1, static_cast<std::size_t>(input.bits.nz));
    parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) { slabs[s].run(stage); });
    std::vector<CapTriangle> caps;
    if (slabs.size() == 1) {
        swap_with_mesh(slabs[0]);
        caps = std::move(slabs[0].caps);
    } else {
        caps = gather(slabs, normals, mesh);
    }
    if (exceptions.size() > 0) {
        std::erase_if(caps, [&](const CapTriangle& cap) {
            return std::any_of(cap.triangle.begin(), cap.triangle.end(),
                               [&](std::uint32_t p) { return exceptions.forbid_widening(mesh.points[p]); });
        });
    }
    relax_caps(input, limit, caps, mesh);
    std::size_t bytes = 0;
    for (const SnapSlab& slab : slabs) bytes += slab.bytes();
    return bytes;
}

}  // namespace

// Without snapping, the surface does not pass through itself. So it is made again, with more and more
// exceptions around the places where it does.
std::size_t snap(const EmitInput& input, double limit, bool normals, const Progress& progress, Mesh& mesh) {
    SnapExceptions exceptions(input);
    std::size_t bytes = snap_once(input, exceptions, limit, normals, sub_progress(progress, 0, 0.5), mesh);
    std::vector<TrianglePair> pairs = find_self_intersections(mesh, OneRings(mesh), progress, 0.5, 1);
    Mesh before;
    for (std::int64_t round = 0;; ++round) {
        const std::size_t known = exceptions.size();
        for (const auto& [s, t] : pairs) {
            exceptions.add(mesh, mesh.triangles[s], round / 2);
            // Less snapping on one side is often enough.
            if (round > 0) exceptions.add(mesh, mesh.triangles[t], round / 2);
        }
        if (exceptions.size() == known) {
            report_progress(progress, 1);
            return bytes + before.points.capacity() * sizeof(Vec3f) +
                   before.normals.capacity() * sizeof(Vec3f) + before.triangles.capacity() * sizeof(Triangle);
        }
        std::swap(before, mesh);
        bytes = snap_once(input, exceptions, limit, normals, sub_progress(progress, 1, 1), mesh);
        pairs = find_self_intersections_again(mesh, before, pairs, progress, 1, 1);
    }
}

}  // namespace marrow::internal
