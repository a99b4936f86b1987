// Allocates the meshes of labels, and lets each slab write its points and triangles where they belong.
#include "emit.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "base/checked_size.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "hold_back_labels.h"
#include "writers.h"

namespace marrow::internal {
namespace {

// The work on all slabs. The background's points and triangles are computed, too, and dropped.
class MeshMaker {
  public:
    MeshMaker(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background)
        : net_(net),
          to_physical_(to_physical),
          background_(background),
          meshes_(net.labels.size()),
          net_points_(net.labels.size()) {
        allocate();
        net.corners.resize(net.corner_count());
    }

    void write_points(std::size_t slab) {
        Vec3f dropped;
        std::uint32_t dropped_index;
        std::vector<PointWriter> writers;
        for (std::size_t l = 0; l < meshes_.size(); ++l) {
            const std::uint64_t before = net_.slabs[slab].counts[l].points;
            writers.push_back(
                {meshes_[l].points.data(), net_points_[l].data(), static_cast<std::uint32_t>(before), 1});
        }
        writers[background_] = {&dropped, &dropped_index, 0, 0};
        emit_label_points(net_, to_physical_, slab, writers.data());
    }

    // Writes the quads of some slices of a slab. The next call for this slab continues after them.
    void write_quads(std::size_t slab, std::int64_t begin, std::int64_t end) {
        std::array<Triangle, 2> dropped;
        std::vector<TriangleWriter> writers;
        std::vector<SurfaceCounts>& counts = net_.slabs[slab].counts;
        for (std::size_t l = 0; l < meshes_.size(); ++l)
            writers.push_back({meshes_[l].triangles.data() + counts[l].half_triangles / 2, 1});
        writers[background_] = {dropped.data(), 0};
        emit_label_quads(net_, to_physical_.mirrored, begin, end, writers.data());
        for (std::size_t l = 0; l < meshes_.size(); ++l) {
            if (l == background_) continue;
            const auto written = writers[l].next - meshes_[l].triangles.data();
            counts[l].half_triangles = 2 * static_cast<std::uint64_t>(written);
        }
    }

    LabelMeshes take() { return {std::move(meshes_), std::move(net_points_)}; }

  private:
    // Gives the meshes their sizes. Replaces the counts of each slab by the sum over all slabs before it,
    // where the slab begins to write.
    void allocate() {
        std::vector<SurfaceCounts> totals(meshes_.size());
        for (SlabOfCells& slab : net_.slabs) {
            for (std::size_t l = 0; l < meshes_.size(); ++l) {
                const SurfaceCounts counts = std::exchange(slab.counts[l], totals[l]);
                totals[l] += counts;
            }
        }
        for (std::size_t l = 0; l < meshes_.size(); ++l) {
            if (l == background_) continue;
            const std::size_t points = checked_size(totals[l].points, sizeof(Vec3f));
            meshes_[l].points.resize(points);
            net_points_[l].resize(points);
            meshes_[l].triangles.resize(checked_size(totals[l].half_triangles / 2, sizeof(Triangle)));
        }
    }

    SurfaceNet& net_;
    const IndexToPhysical& to_physical_;
    const LabelIndex background_;
    std::vector<Mesh> meshes_;
    std::vector<Buffer<std::uint32_t>> net_points_;
};

}  // namespace

LabelMeshes make_label_meshes(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background,
                              const Progress& progress) {
    MeshMaker maker(net, to_physical, background);
    const std::size_t slabs = net.slabs.size();
    Stage stage(progress, 0, 1, 2 * slabs);
    // Quads are written while their corners are in the cache. But those of the first slice also need corners
    // of the slab below, so they wait until all points are written.
    parallel_for(std::size_t{0}, slabs, [&](std::size_t slab) {
        maker.write_points(slab);
        maker.write_quads(slab, SurfaceNet::first_slice(slab) + 1, net.end_slice(slab));
        stage.step();
    });
    parallel_for(std::size_t{0}, slabs, [&](std::size_t slab) {
        maker.write_quads(slab, SurfaceNet::first_slice(slab), SurfaceNet::first_slice(slab) + 1);
        stage.step();
    });
    return maker.take();
}

std::vector<std::vector<SurfaceCounts>> counts_of(const SurfaceNet& net) {
    std::vector<std::vector<SurfaceCounts>> counts;
    for (const SlabOfCells& slab : net.slabs) counts.push_back(slab.counts);
    return counts;
}

Buffer<Vec3f> positions_before_relaxation(SurfaceNet& net, std::vector<std::vector<SurfaceCounts>> counts,
                                          const IndexToPhysical& to_physical, LabelIndex background,
                                          const Progress& progress) {
    net.points = Buffer<NetPoint>();  // `= {}` would keep the memory
    for (std::size_t s = 0; s < counts.size(); ++s) net.slabs[s].counts = std::move(counts[s]);
    return net_positions(make_label_meshes(net, to_physical, background, progress), net.point_count());
}

LabelMeshes make_relaxed_meshes(SurfaceNet& net, const IndexToPhysical& to_physical, LabelIndex background,
                                const Progress& progress) {
    std::vector<std::vector<SurfaceCounts>> counts = counts_of(net);
    LabelMeshes relaxed = make_label_meshes(net, to_physical, background, sub_progress(progress, 0, 0.5));
    if (net.points.empty()) return relaxed;
    hold_back_labels(
        relaxed, net.point_count(),
        [&](const Progress& part) {
            return positions_before_relaxation(net, std::move(counts), to_physical, background, part);
        },
        sub_progress(progress, 0.5, 1));
    return relaxed;
}

}  // namespace marrow::internal
