// Classifies the active cells of a label map, and counts the points and triangles of each label's mesh.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/surface_net.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "surface_net.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Which corners of 64 two-label cells have another label than corner 0, bit-sliced: bit b of differs[v] is
// corner v of cell b.
struct TwoLabelCorners {
    alignas(64) std::uint64_t differs[8];

    TwoLabelCorners(const CrossedEdges& crossed, std::size_t w) {
        const auto edge = [&](std::size_t e) { return crossed.word(e, w); };
        differs[0] = 0;
        differs[1] = edge(0);
        differs[2] = edge(4);
        differs[4] = edge(6);
        // With two labels, a path over two crossed edges leads back to the first label.
        differs[3] = edge(0) ^ edge(8);
        differs[5] = edge(0) ^ edge(10);
        differs[6] = edge(4) ^ edge(7);
        differs[7] = differs[3] ^ edge(11);
    }

    // The corners of the cell whose bit is set: bit v of the result is corner v.
    HWY_INLINE unsigned of_cell(std::uint64_t bit) const {
        const hn::CappedTag<std::uint64_t, 8> d;
        const auto cell = hn::Set(d, bit);
        unsigned corners = 0;
        for (std::size_t v = 0; v < 8; v += hn::MaxLanes(d)) {
            std::uint8_t lanes[8] = {};  // as many bytes as StoreMaskBits may write
            hn::StoreMaskBits(d, hn::TestBit(hn::Load(d, differs + v), cell), lanes);
            corners |= static_cast<unsigned>(lanes[0]) << v;
        }
        return corners;
    }
};

// Makes the cells of a slab, row by row.
template <class T>
class CellMaker {
  public:
    CellMaker(const LabelMap& map, SurfaceNet& net, SlabOfCells& slab, CellPatternCache& patterns)
        : labels_(map),
          outside_(static_cast<std::size_t>(map.dims[0]), labels_.background),
          bits_(net.bits),
          cases_(net.cases.data()),
          label_pairs_(net.label_pairs.data()),
          slab_(slab),
          index_of_(net.labels),
          patterns_(patterns) {
        slab.counts.resize(net.labels.size());
        slab.half_triangles_next.resize(net.labels.size());
        counts_ = slab.counts.data();
    }

    void make_row(std::int64_t j, std::int64_t k) {
        for (std::size_t v = 0; v < 8; ++v) {
            const T* samples =
                labels_.row(j + static_cast<std::int64_t>(v >> 1 & 1), k + static_cast<std::int64_t>(v >> 2));
            corner_rows_[v] = (samples != nullptr ? samples : outside_.data()) + (v & 1);
        }
        const CellRow row(bits_, j, k);
        const CrossedEdges crossed(bits_, j, k);
        const auto last = static_cast<std::size_t>(bits_.dims[0]);
        std::uint32_t id = row.first;
        for (std::size_t w = 0; w < bits_.words; ++w) {
            const std::uint64_t active = row.active[w], multi_label = row.multi_label[w];
            if (active == 0) continue;
            prefetch_next_row(w);
            const TwoLabelCorners corners(crossed, w);
            // The first and the last cell have corners beyond the samples of the row.
            const std::uint64_t ends =
                (w == 0 ? 1 : 0) | (w == last / 64 ? std::uint64_t{1} << last % 64 : 0);
            for (std::uint64_t left = active; left != 0; left &= left - 1, ++id) {
                const std::uint64_t bit = left & -left;
                const std::size_t i = 64 * w + static_cast<std::size_t>(std::countr_zero(left));
                const unsigned differing = corners.of_cell(bit);
                if ((bit & (multi_label | ends)) == 0)
                    make_two_label(id, differing,
                                   [&](std::size_t v) { return index_of_(corner_rows_[v][i - 1]); });
                else if ((bit & multi_label) == 0)
                    make_two_label(id, differing, [&](std::size_t v) { return index_at_corner(i, v); });
                else
                    make_multi_label(id, {static_cast<std::int64_t>(i), j, k});
            }
        }
    }

  private:
    // Where cells are active, those in the next row are likely to be active too. Of its samples, only the row
    // at corner 6 has not been read recently.
    HWY_INLINE void prefetch_next_row(std::size_t w) const {
        const auto next = reinterpret_cast<std::uintptr_t>(corner_rows_[6]) +
                          sizeof(T) * (64 * w + static_cast<std::size_t>(bits_.dims[0]));
        for (std::size_t byte = 0; byte < 64 * sizeof(T); byte += 64)
            __builtin_prefetch(reinterpret_cast<const void*>(next + byte));
    }

    LabelIndex index_at_corner(std::size_t i, std::size_t v) {
        const std::size_t sample = i + (v & 1);
        const bool within = sample >= 1 && sample <= static_cast<std::size_t>(bits_.dims[0]);
        return index_of_(within ? corner_rows_[v][i - 1] : labels_.background);
    }

    // `differing` has a bit for each corner with another label than corner 0.
    template <class IndexAtCorner>
    HWY_INLINE void make_two_label(std::uint32_t id, unsigned differing, const IndexAtCorner& index) {
        const LabelPair pair{index(0), index(static_cast<std::size_t>(std::countr_zero(differing)))};
        const SurfaceCounts counts = table_[differing >> 1].counts;
        cases_[id] = static_cast<std::uint8_t>(differing >> 1);
        label_pairs_[id] = pair;
        counts_[pair.lower] += counts;
        counts_[pair.upper] += counts;
    }

    HWY_NOINLINE void make_multi_label(std::uint32_t id, const Index3& index) {
        std::array<LabelIndex, 8> corners;
        for (std::size_t v = 0; v < 8; ++v)
            corners[v] = index_at_corner(static_cast<std::size_t>(index[0]), v);
        const CellPattern& pattern = patterns_.find(CellCorners(corners));
        cases_[id] = 0;
        label_pairs_[id] = LabelPair::from_number(slab_.multi_label_cells.size());
        MultiLabelCell& cell = slab_.multi_label_cells.emplace_back();
        cell.pattern = &pattern;
        for (std::size_t a = 0; a < 3; ++a) cell.index[a] = static_cast<std::int32_t>(index[a]);
        cell.id = id;
        cell.first_corner = slab_.extra_corners;
        cell.first_extra_point = slab_.extra_points;
        slab_.extra_corners += static_cast<std::uint32_t>(pattern.corners.size());
        slab_.extra_points += static_cast<std::uint32_t>(pattern.positions.size() - 1);
        const bool is_last_slice = (index[2] + 1) % SlabOfCells::kSlices == 0;
        for (std::size_t n = 0; n < pattern.labels.size(); ++n) {
            const CellPattern::Label& label = pattern.labels[n];
            const LabelIndex l = cell.index_of_label[n] = corners[label.corner];
            counts_[l] += label.counts;
            (is_last_slice ? slab_.half_triangles_next[l] : counts_[l].half_triangles) +=
                label.half_triangles_next;
        }
    }

    const LabelReader<T> labels_;
    const std::vector<T> outside_;
    const BorderBits& bits_;
    std::uint8_t* const cases_;
    LabelPair* const label_pairs_;
    SlabOfCells& slab_;
    SurfaceCounts* counts_;
    LabelIndexFinder<T> index_of_;
    CellPatternCache& patterns_;
    const TwoLabelCase* const table_ = two_label_cases().data();
    // For each corner its row of samples: corner v of cell i is corner_rows_[v][i - 1].
    std::array<const T*, 8> corner_rows_{};
};

void make_slab(const LabelMap& map, SurfaceNet& net, std::size_t slab, CellPatternCache& patterns) {
    visit_sample_type(map.type, [&](auto sample) {
        CellMaker<decltype(sample)> maker(map, net, net.slabs[slab], patterns);
        for (std::int64_t k = SurfaceNet::first_slice(slab); k < net.end_slice(slab); ++k) {
            for (std::int64_t j = 0; j < net.bits.cell_rows(); ++j) {
                if (net.bits.has_active_cells(j, k)) maker.make_row(j, k);
            }
        }
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(make_slab);

// Tells each slab where its extra points and corners begin, and adds what slabs counted for the next one.
void join_slabs(SurfaceNet& net) {
    std::uint64_t corners = 0, points = 0;
    for (std::size_t s = 0; s < net.slabs.size(); ++s) {
        SlabOfCells& slab = net.slabs[s];
        for (std::size_t l = 0; s > 0 && l < net.labels.size(); ++l)
            slab.counts[l].half_triangles += net.slabs[s - 1].half_triangles_next[l];
        slab.first_extra_corner = static_cast<std::uint32_t>(corners);
        slab.first_extra_point = static_cast<std::uint32_t>(points);
        corners += slab.extra_corners;
        points += slab.extra_points;
        // No cell has more points than corners.
        const std::uint64_t all = net.cell_count() + corners;
        if (all >= std::numeric_limits<std::uint32_t>::max()) throw_too_many_label_points(all);
    }
}

}  // namespace

SurfaceNet make_surface_net(const LabelMap& map, BorderBits bits, const Progress& progress) {
    SurfaceNet net{std::move(bits)};
    net.labels = find_label_values(map, net.bits, sub_progress(progress, 0, 0.2));
    net.label_pairs.resize(net.bits.active_cells());
    net.cases.resize(net.bits.active_cells());
    const std::int64_t slices = net.bits.cell_slices();
    net.slabs.resize(static_cast<std::size_t>((slices + SlabOfCells::kSlices - 1) / SlabOfCells::kSlices));
    Stage stage(progress, 0.2, 1, net.slabs.size());
    PerThread<CellPatternCache> patterns;
    parallel_for(std::size_t{0}, net.slabs.size(), [&](std::size_t slab) {
        HWY_DYNAMIC_DISPATCH(make_slab)(map, net, slab, patterns.local());
        stage.step();
    });
    join_slabs(net);
    return net;
}

}  // namespace marrow::internal
#endif
