#include "emit.h"

#include <algorithm>
#include <array>
#include <utility>

#include <tbb/parallel_for.h>

#include "writers.h"

namespace marrow::internal {
namespace {

// Gives the meshes as many points and triangles as their labels have, and each piece instead of its shares those of the pieces
// before it.
void allocate(LabelNet& net, Place background, std::vector<Mesh>& meshes) {
    std::vector<SurfaceShare> totals(meshes.size());
    for (NetPiece& piece : net.pieces) {
        for (std::size_t place = 0; place < meshes.size(); ++place) {
            const SurfaceShare share = std::exchange(piece.shares[place], totals[place]);
            totals[place] += share;
        }
    }
    for (std::size_t place = 0; place < meshes.size(); ++place) {
        if (place == background) continue;
        meshes[place].points.resize(totals[place].points);
        meshes[place].triangles.resize(totals[place].half_triangles / 2);
    }
}

void place_points_of(std::size_t p, LabelNet& net, const IndexToPhysical& frame, Place background,
                     std::vector<Mesh>& meshes) {
    Vec3f dropped;
    std::vector<PointWriter> writers;
    for (std::size_t place = 0; place < meshes.size(); ++place) {
        const std::uint64_t before = net.pieces[p].shares[place].points;
        writers.push_back({meshes[place].points.data(), static_cast<std::uint32_t>(before), 1});
    }
    writers[background] = {&dropped, 0, 0};
    place_points(net, frame, p, writers.data());
}

// Of some slices of a piece; others can follow.
void make_patches_of(std::size_t p, LabelNet& net, const IndexToPhysical& frame, Place background,
                     std::vector<Mesh>& meshes, std::int64_t begin, std::int64_t end) {
    std::array<Triangle, 2> dropped;
    std::vector<TriangleWriter> writers;
    std::vector<SurfaceShare>& shares = net.pieces[p].shares;
    for (std::size_t place = 0; place < meshes.size(); ++place)
        writers.push_back({meshes[place].triangles.data() + shares[place].half_triangles / 2, 1});
    writers[background] = {dropped.data(), 0};
    make_patches(net, frame.mirrored, begin, end, writers.data());
    for (std::size_t place = 0; place < meshes.size(); ++place) {
        if (place == background) continue;
        const auto written = writers[place].next - meshes[place].triangles.data();
        shares[place].half_triangles = 2 * static_cast<std::uint64_t>(written);
    }
}

}  // namespace

std::vector<Mesh> emit(LabelNet& net, const IndexToPhysical& frame, Place background, Stage& stage) {
    std::vector<Mesh> meshes(net.values.size());
    allocate(net, background, meshes);
    net.corners.resize(net.corner_count());
    // Patches while their corners are in the cache; but those of a piece's first slice have some of the piece before.
    const auto first_slice = [&](std::size_t p) { return static_cast<std::int64_t>(p) * NetPiece::kSlices; };
    tbb::parallel_for(std::size_t{0}, net.pieces.size(), [&](std::size_t p) {
        const std::int64_t end = std::min(first_slice(p + 1), net.bits.dims[2] + 1);
        place_points_of(p, net, frame, background, meshes);
        make_patches_of(p, net, frame, background, meshes, first_slice(p) + 1, end);
        stage.step();
    });
    tbb::parallel_for(std::size_t{0}, net.pieces.size(), [&](std::size_t p) {
        make_patches_of(p, net, frame, background, meshes, first_slice(p), first_slice(p) + 1);
        stage.step();
    });
    return meshes;
}

}  // namespace marrow::internal
