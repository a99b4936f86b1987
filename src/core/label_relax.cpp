#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "label_relax.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "label_relax.h"

#ifndef MARROW_LABEL_RELAX_TYPES  // once for all targets
#define MARROW_LABEL_RELAX_TYPES
namespace marrow::internal {

// Four numbers to a point are as quick as one; the fourth is not used.
struct alignas(16) RelaxedPoint {
    float at[4];
};

// The points that each point is joined with, by the face of its cell. Where there is none: an additional point behind all, at 0.
using Neighbours = std::array<std::uint32_t, 6>;

}  // namespace marrow::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// One pass over points [begin, end): `step` of the way to the mean of the neighbours.
void relax_points(const Neighbours* neighbours, const std::uint8_t* joined, const RelaxedPoint* from,
                  RelaxedPoint* to, std::size_t begin, std::size_t end, float step) {
    const hn::CappedTag<float, 4> d;
    constexpr float kReach = 0.45f;  // from the middle of the cell: points of neighbouring cells stay apart
    const auto half = hn::Set(d, 0.5f), reach = hn::Set(d, kReach);
    for (std::size_t p = begin; p < end; ++p) {
        const auto count = static_cast<float>(__builtin_popcount(joined[p]));
        const float way = joined[p] != 0 ? step : 0;
        const auto share = hn::Set(d, joined[p] != 0 ? step / count : 0), whole = hn::Set(d, way);
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            auto sum = hn::Load(d, from[neighbours[p][0]].at + i);
            for (std::size_t f = 1; f < 6; ++f)
                sum = hn::Add(sum, hn::Load(d, from[neighbours[p][f]].at + i));
            const auto here = hn::Load(d, from[p].at + i);
            const auto moved = hn::Add(here, hn::Sub(hn::Mul(share, sum), hn::Mul(whole, here)));
            const auto home =
                hn::Add(hn::Floor(here), half);  // the middle of its cell, which a point does not leave
            hn::Store(hn::Min(hn::Max(moved, hn::Sub(home, reach)), hn::Add(home, reach)), d, to[p].at + i);
        }
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "case_table.h"

namespace marrow::internal {
namespace {

HWY_EXPORT(relax_points);

// The point of a neighbouring cell that is joined with this cell's through the neighbour's face f.
std::uint32_t joined_point(const LabelNet& net, std::uint32_t id, std::size_t f) {
    if (!net.is_complex(id)) return id;
    // All crossed edges of the face are in one knot, so any of them tells the patch.
    const ComplexCell& cell = net.complex_cell(id);
    for (const int e : kFaceEdges[f]) {
        const int patch = cell.patches.patch_of_edge[static_cast<std::size_t>(e)];
        if (patch >= 0) return cell.point(patch);
    }
    return id;
}

Buffer<Neighbours> find_neighbours(const LabelNet& net) {
    Buffer<Neighbours> neighbours(net.joined.size());
    const auto none = static_cast<std::uint32_t>(net.points.size());
    const BorderBits& bits = net.bits;
    tbb::parallel_for(std::int64_t{0}, bits.dims[2] + 1, [&](std::int64_t k) {
        // The rows behind the faces along y and z.
        std::array<CellIds, 4> beside{CellIds(bits), CellIds(bits), CellIds(bits), CellIds(bits)};
        for (std::int64_t j = 0; j <= bits.dims[1]; ++j) {
            const std::size_t row = bits.row(j, k);
            if (net.before[row] == net.before[row + bits.words]) continue;
            if (j > 0) beside[0].fill(net, j - 1, k);
            beside[1].fill(net, j + 1, k);
            if (k > 0) beside[2].fill(net, j, k - 1);
            beside[3].fill(net, j, k + 1);
            for_each_active(net, j, k, [&](std::uint32_t id, std::int64_t i) {
                Neighbours& n = neighbours[id];
                for (std::size_t f = 0; f < 6; ++f) {
                    n[f] = none;
                    if ((net.joined[id] >> f & 1) == 0) continue;
                    const std::uint32_t other = f == 0 ? id - 1 : f == 1 ? id + 1 : beside[f - 2][i];
                    n[f] = joined_point(net, other, f ^ 1);
                }
            });
        }
    });
    return neighbours;
}

}  // namespace

void relax(LabelNet& net, int passes, const Progress& progress) {
    if (passes == 0) return;
    // Of the way to the mean of the neighbours, and in every other pass away from it, a little more, so that surfaces do not
    // shrink (Taubin 1995: what passes are waves of 10 % and less of the sharpest).
    constexpr float kSteps[] = {0.6307f, -0.6732f};
    const Buffer<Neighbours> neighbours = find_neighbours(net);
    Buffer<RelaxedPoint> from(net.points.size() + 1), to(from.size());
    for (std::size_t p = 0; p < net.points.size(); ++p) {
        const Vec3f& at = net.points[p];
        from[p] = to[p] = {{at[0], at[1], at[2], 0}};
    }
    from.back() = to.back() = {{0, 0, 0, 0}};
    Stage stage(progress, 0.3, 0.6, static_cast<std::size_t>(passes));
    for (int pass = 0; pass < passes; ++pass) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, neighbours.size(), 1 << 14),
                          [&](const auto& range) {
                              HWY_DYNAMIC_DISPATCH(relax_points)
                              (neighbours.data(), net.joined.data(), from.data(), to.data(), range.begin(),
                               range.end(), kSteps[pass % 2]);
                          });
        std::swap(from, to);
        stage.step();
    }
    for (std::size_t p = 0; p < net.points.size(); ++p)
        net.points[p] = {from[p].at[0], from[p].at[1], from[p].at[2]};
}

}  // namespace marrow::internal
#endif
