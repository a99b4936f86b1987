// Extracts the surfaces of the labels of a part from the samples around it, and
// keeps what begins in its rows.
#include <marrow/label_parts.h>

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "base/progress.h"
#include "core/grid/index_to_physical.h"
#include "core/volume/checks.h"
#include "core/volume/enlarged.h"
#include "emit.h"
#include "label_part_keys.h"
#include "relaxed_net.h"

namespace marrow {

using namespace internal;

namespace {

// The cell of a point of the net, in the whole map.
struct Origin {
    Index3 cell;
    std::uint8_t number;  // among the points of the cell
    bool multi_label;
};

// Where the points of a net come from. `first` is the whole map's index of the net's first sample.
std::vector<Origin> origins_of(const SurfaceNet& net, const Index3& first) {
    std::vector<Origin> origins(net.point_count());
    const BorderBits& bits = net.bits;
    std::size_t id = 0;
    for (std::int64_t k = 0; k < bits.cell_slices(); ++k) {
        for (std::int64_t j = 0; j < bits.cell_rows(); ++j) {
            const CellRow row(bits, j, k);
            for (std::size_t w = 0; w < bits.words; ++w) {
                for (std::uint64_t left = row.active[w]; left != 0; left &= left - 1, ++id) {
                    const auto i = static_cast<std::int64_t>(64 * w) + std::countr_zero(left);
                    origins[id] = {{first[0] + i, first[1] + j, first[2] + k},
                                   0,
                                   (row.multi_label[w] & left & -left) != 0};
                }
            }
        }
    }
    for (const SlabOfCells& slab : net.slabs) {
        for (const MultiLabelCell& cell : slab.multi_label_cells) {
            for (std::size_t n = 1; n < cell.pattern->positions.size(); ++n) {
                Origin& origin = origins[net.extra_point(slab, cell, n)];
                origin = origins[cell.id];
                origin.number = static_cast<std::uint8_t>(n);
            }
        }
    }
    return origins;
}

// The rows of samples in which the part's edges begin, in the indices of borders.h.
struct OwnRows {
    std::array<std::int64_t, 3> begin, end;

    explicit OwnRows(const VolumeView& part) {
        for (std::size_t a = 0; a < 3; ++a) {
            begin[a] =
                part.first[a] == 0 ? 0 : part.first[a] + 1;  // the first part has the layer before the map
            end[a] = part.first[a] + part.geometry.dims[a] + 1;
        }
    }
    bool have(const EdgeRow& row) const {
        return row.j >= begin[1] && row.j < end[1] && row.k >= begin[2] && row.k < end[2];
    }
};

// Gives those elements that are used new indices, in the same order.
class Selection {
  public:
    explicit Selection(std::size_t count) : index_(count, kNone) {}

    void use(std::size_t i) { index_[i] = 0; }
    bool uses(std::size_t i) const { return index_[i] != kNone; }
    std::uint32_t operator[](std::size_t i) const { return index_[i]; }
    void number() {
        std::uint32_t next = 0;
        for (std::uint32_t& index : index_)
            if (index != kNone) index = next++;
    }

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::vector<std::uint32_t> index_;
};

// The triangles of a label that begin in the part's own rows, and their points.
// `net_points` still counts in the net.
LabelPart::Surface own_surface(const Mesh& mesh, const Buffer<std::uint32_t>& net_points,
                               const std::vector<Origin>& origins, const OwnRows& rows,
                               const LabelPartKeys& keys) {
    LabelPart::Surface surface;
    const auto cell_of = [&](std::uint32_t point) -> const Index3& {
        return origins[net_points[point]].cell;
    };
    Selection used(net_points.size());
    for (const Triangle& t : mesh.triangles) {
        if (!rows.have(EdgeRow::of(cell_of(t[0]), cell_of(t[1]), cell_of(t[2])))) continue;
        surface.triangles.push_back(t);
        for (const std::uint32_t point : t) used.use(point);
    }
    used.number();
    std::uint64_t number = 0;  // among the label's points in the cell, which follow each other
    for (std::size_t p = 0; p < net_points.size(); ++p) {
        const Origin& origin = origins[net_points[p]];
        number = p > 0 && origin.cell == origins[net_points[p - 1]].cell ? number + 1 : 0;
        if (!used.uses(p)) continue;
        surface.keys.push_back(keys.label_point(origin.cell, origin.multi_label, number));
        surface.net_points.push_back(net_points[p]);
    }
    for (Triangle& t : surface.triangles) {
        for (std::uint32_t& point : t) point = used[point];
    }
    return surface;
}

void check(const VolumeView& part, const std::array<std::int64_t, 3>& whole, const LabelOptions& options) {
    check_volume(part);
    check_not_rescaled(part);
    check_label_options(options);
    Geometry geometry = part.geometry;
    geometry.dims = whole;
    check_geometry(geometry);
    if (part.first[0] != 0 || part.geometry.dims[0] != whole[0])
        throw InputError("a part of a label map has whole rows along x: cut the map along y and z only");
    const std::int64_t halo = label_part_halo(options);
    for (const std::size_t a : {std::size_t{1}, std::size_t{2}}) {
        const std::int64_t after = whole[a] - part.first[a] - part.geometry.dims[a];
        const std::string axis = std::to_string(a);
        if (part.geometry.dims[a] < 1 || after < 0)
            throw InputError("a part has no samples, or leaves the whole map, along axis " + axis);
        if (part.below[a] < std::min(halo, part.first[a]) || part.above[a] < std::min(halo, after))
            throw InputError("a part needs " + std::to_string(halo) +
                             " samples around it for relaxation, and lacks some along axis " + axis +
                             ": give them in `below` and `above`, or relax less");
    }
}

}  // namespace

LabelPart extract_label_part(const VolumeView& part, const std::array<std::int64_t, 3>& whole,
                             const LabelOptions& options) {
    check(part, whole, options);
    const LabelPartKeys keys(whole);
    LabelPart result{whole, part.first, part.geometry.dims, {}, {}, {}, {}};
    std::array<std::int64_t, 3> before{}, after{};
    for (const std::size_t a : {std::size_t{1}, std::size_t{2}}) {
        before[a] = std::min(label_part_halo(options), part.first[a]);
        after[a] = std::min(label_part_halo(options), whole[a] - part.first[a] - part.geometry.dims[a]);
    }
    const VolumeView view = enlarged(part, before, after);
    with_threads(options.threads, [&] {
        auto [net, background] = make_relaxed_net(view, options, sub_progress(options.progress, 0, 0.6));
        const IndexToPhysical to_physical(view);
        const bool relaxed = !net.points.empty();
        std::vector<std::vector<SurfaceCounts>> counts = counts_of(net);
        const LabelMeshes labels =
            make_label_meshes(net, to_physical, background, sub_progress(options.progress, 0.6, 0.8));
        const std::vector<Origin> origins = origins_of(net, view.first);
        Selection used(origins.size());
        for (std::size_t l = 0; l < labels.meshes.size(); ++l) {
            LabelPart::Surface surface =
                own_surface(labels.meshes[l], labels.net_points[l], origins, OwnRows(part), keys);
            if (surface.triangles.empty()) continue;
            surface.label = net.labels[l];
            for (const std::uint32_t point : surface.net_points) used.use(point);
            result.surfaces.push_back(std::move(surface));
        }
        used.number();
        for (LabelPart::Surface& surface : result.surfaces) {
            for (std::uint32_t& point : surface.net_points) point = used[point];
        }
        const auto selected = [&](const Buffer<Vec3f>& all) {
            Buffer<Vec3f> positions;
            for (std::size_t p = 0; p < all.size(); ++p)
                if (used.uses(p)) positions.push_back(all[p]);
            return positions;
        };
        for (std::size_t p = 0; p < origins.size(); ++p)
            if (used.uses(p)) result.net_keys.push_back(keys.net_point(origins[p].cell, origins[p].number));
        result.positions = selected(net_positions(labels, origins.size()));
        if (relaxed)
            result.positions_before_relaxation = selected(positions_before_relaxation(
                net, std::move(counts), to_physical, background, sub_progress(options.progress, 0.9, 1)));
    });
    report_progress(options.progress, 1);
    return result;
}

}  // namespace marrow
