// Smooths a surface net: lists the stencils of its points once, then applies them in many passes.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/relax.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "relax.h"
#include "stencils.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Moves the points of some stencils as PassTable says.
template <std::size_t kMaxNeighbours>
HWY_INLINE void apply_stencils(std::span<const Stencil<kMaxNeighbours>> stencils, const PassTable& table,
                               const NetPoint* from, NetPoint* to) {
    const hn::CappedTag<float, 4> d;
    constexpr float kReach = 0.45f;  // below 1/2, so that the points of neighbouring cells stay apart
    const auto keep = hn::Set(d, table.keep), upper = hn::Set(d, kReach), lower = hn::Set(d, -kReach);
    for (const Stencil<kMaxNeighbours>& stencil : stencils) {
        const float* const step = table.by_faces[stencil.faces].xyz;
#if HWY_TARGET == HWY_SCALAR
        const auto factor = hn::Set(d, step[3]);
#else
        // Loads take most of the time. The vector of the step is needed anyway, and has the factor.
        const auto factor = hn::Broadcast<3>(hn::Load(d, step));
#endif
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            const auto neighbour = [&](std::size_t n)
                                       HWY_ATTR { return hn::Load(d, from[stencil.neighbours[n]].xyz + i); };
            auto sum = hn::Add(hn::Add(neighbour(0), neighbour(1)), hn::Add(neighbour(2), neighbour(3)));
            if constexpr (kMaxNeighbours == 6) sum = hn::Add(sum, hn::Add(neighbour(4), neighbour(5)));
            const auto own = hn::Load(d, from[stencil.point].xyz + i);
            const auto moved =
                hn::Add(hn::Add(hn::Mul(keep, own), hn::Mul(factor, sum)), hn::Load(d, step + i));
            hn::Store(hn::Min(hn::Max(moved, lower), upper), d, to[stencil.point].xyz + i);
        }
    }
}

void relax_slice(const SliceStencils& stencils, const PassTable& table, const NetPoint* from, NetPoint* to) {
    apply_stencils(std::span<const Stencil<4>>(stencils.up_to_four.data(), stencils.up_to_four_count), table,
                   from, to);
    apply_stencils(std::span<const Stencil<6>>(stencils.more), table, from, to);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(relax_slice);

// A pass that moves points by `step` times the way to the mean of their neighbours.
PassTable make_pass_table(float step) {
    PassTable table{1 - step, {}};
    for (unsigned faces = 1; faces < table.by_faces.size(); ++faces) {
        NetPoint& entry = table.by_faces[faces];
        const float factor = step / static_cast<float>(std::popcount(faces));
        for (std::size_t a = 0; a < 3; ++a) {
            const int upper = static_cast<int>(faces >> (2 * a + 1) & 1),
                      lower = static_cast<int>(faces >> (2 * a) & 1);
            entry.xyz[a] = factor * static_cast<float>(upper - lower);
        }
        entry.xyz[3] = factor;
    }
    return table;
}

// Every pass reads one buffer and writes the other. Both begin with the positions before relaxation, and end
// with the point at 0 for missing neighbours.
using PointBuffers = std::array<Buffer<NetPoint>, 2>;

PointBuffers make_point_buffers(const SurfaceNet& net, const Progress& progress) {
    Stage stage(progress, 0, 1, net.slabs.size());
    const std::size_t count = net.point_count();
    PointBuffers buffers{Buffer<NetPoint>(count + 1), Buffer<NetPoint>(count + 1)};
    const auto set = [&](std::size_t p, const NetPoint& position) {
        buffers[0][p] = buffers[1][p] = position;
    };
    set(count, NetPoint{});
    const std::array<TwoLabelCase, 128>& cases = two_label_cases();
    const BorderBits& bits = net.bits;
    parallel_for(std::size_t{0}, net.slabs.size(), [&](std::size_t s) {
        const SlabOfCells& slab = net.slabs[s];
        const std::size_t end = bits.first_cell[bits.row(0, net.end_slice(s))];
        for (std::size_t id = bits.first_cell[bits.row(0, SurfaceNet::first_slice(s))]; id < end; ++id)
            set(id, cases[net.cases[id]].position);
        for (const MultiLabelCell& cell : slab.multi_label_cells) {
            const std::vector<NetPoint>& positions = cell.pattern->positions;
            set(cell.id, positions[0]);
            for (std::size_t n = 1; n < positions.size(); ++n)
                set(net.extra_point(slab, cell, n), positions[n]);
        }
        stage.step();
    });
    return buffers;
}

// Runs some passes over all slices, several of them together.
//
// In each slice, a pass needs what the previous pass made of this slice and of those below and above it. So a
// pass can follow one slice after the previous one, while all of these are in the cache. Each thread does
// this in a band of slices. Pass p stops p slices before the border of the band, since it would need slices
// of the next band. The gaps that remain are filled when all bands are done:
//
//     pass 2   a a a a . . . . b b b b     a, b: two bands
//     pass 1   a a a a a . . b b b b b     .: the gap between them
//     pass 0   a a a a a a b b b b b b
//     slice    0 1 2 3 4 5 6 7 8 9 ...
class PassScheduler {
  public:
    static constexpr int kPassesTogether = 4;

    // Bands are wide enough that the gaps at their borders do not meet.
    explicit PassScheduler(std::int64_t slices)
        : slices_(slices),
          bands_(std::max<std::int64_t>(
              1, std::min<std::int64_t>(thread_count(), slices / (2 * kPassesTogether)))) {}

    // Calls relax(k, p) for each slice k and for p from 0 to passes - 1. \pre passes <= kPassesTogether
    template <class Relax>
    void run(int passes, const Relax& relax) const {
        parallel_for(std::int64_t{0}, bands_, [&](std::int64_t band) { run_band(band, passes, relax); });
        parallel_for(std::int64_t{1}, bands_,
                     [&](std::int64_t band) { fill_gap(begin_of(band), passes, relax); });
    }

  private:
    std::int64_t begin_of(std::int64_t band) const { return slices_ * band / bands_; }

    template <class Relax>
    void run_band(std::int64_t band, int passes, const Relax& relax) const {
        const std::int64_t begin = begin_of(band), end = begin_of(band + 1);
        for (std::int64_t front = begin; front < end + passes; ++front) {
            for (int pass = 0; pass < passes; ++pass) {
                const std::int64_t k = front - pass;
                const std::int64_t first = begin + (band > 0 ? pass : 0);
                const std::int64_t last = end - (band + 1 < bands_ ? pass : 0);
                if (k >= first && k < last) relax(k, pass);
            }
        }
    }

    template <class Relax>
    void fill_gap(std::int64_t border, int passes, const Relax& relax) const {
        for (int pass = 1; pass < passes; ++pass) {
            for (std::int64_t k = border - pass; k < border + pass; ++k) relax(k, pass);
        }
    }

    const std::int64_t slices_, bands_;
};

}  // namespace

void relax(SurfaceNet& net, int passes, const Progress& progress) {
    if (passes == 0) return;
    // Every other pass moves points away from the mean, by a little more, so that surfaces do not shrink
    // (Taubin 1995, with a pass band of 10 %).
    const PassTable tables[] = {make_pass_table(0.6307f), make_pass_table(-0.6732f)};
    PointBuffers points = make_point_buffers(net, sub_progress(progress, 0, 0.1));
    const std::vector<SliceStencils> stencils = make_stencils(net, sub_progress(progress, 0.1, 0.3));

    constexpr std::int64_t kTogether = PassScheduler::kPassesTogether;
    const PassScheduler scheduler(net.bits.cell_slices());
    Stage stage(progress, 0.3, 1, static_cast<std::size_t>(passes) * stencils.size());
    for (std::int64_t first = 0; first < passes; first += kTogether) {
        scheduler.run(static_cast<int>(std::min(kTogether, passes - first)), [&](std::int64_t k, int pass) {
            const auto parity = static_cast<std::size_t>((first + pass) % 2);
            HWY_DYNAMIC_DISPATCH(relax_slice)
            (stencils[static_cast<std::size_t>(k)], tables[parity], points[parity].data(),
             points[1 - parity].data());
            stage.step();
        });
    }
    net.points = std::move(points[static_cast<std::size_t>(passes % 2)]);
}

}  // namespace marrow::internal
#endif
