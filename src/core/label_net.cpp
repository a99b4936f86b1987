#include "label_net.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "case_table.h"

namespace marrow::internal {
namespace {

// Calls f(id, {i, j, k}, mask of crossed edges) for the active cells of a slice.
template <class F>
void for_each_cell(const LabelNet& net, std::int64_t k, const F& f) {
    const BorderBits& bits = net.bits;
    for (std::int64_t j = 0; j <= bits.dims[1]; ++j) {
        const std::size_t row = bits.row(j, k);
        CellRow cells(bits, j, k);
        for (std::size_t w = 0; w < bits.words; ++w) {
            std::uint64_t active = bits.active[row + w];
            if (active == 0) continue;
            cells.move_to(w);
            for (std::uint32_t id = net.before[row + w]; active != 0; active &= active - 1) {
                const int b = __builtin_ctzll(active);
                f(id++, Index3{static_cast<std::int64_t>(64 * w) + b, j, k},
                  cells.mask(static_cast<unsigned>(b)));
            }
        }
    }
}

[[noreturn]] void throw_too_many(std::uint64_t points) {
    throw LimitError("the label map's surfaces have " + std::to_string(points) +
                     " points, more than the 2^32 - 1 that triangles can name; crop or coarsen it");
}

void number_cells(LabelNet& net) {
    std::uint64_t total = 0;
    for (std::size_t w = 0; w < net.before.size(); ++w) {
        net.before[w] = static_cast<std::uint32_t>(total);
        total += static_cast<std::uint64_t>(__builtin_popcountll(net.bits.active[w]));
        if (total > std::numeric_limits<std::uint32_t>::max()) throw_too_many(total);
    }
    net.complex_number.assign(total, 0);
    net.joined.assign(total, 0);
    net.points.resize(total);
}

// The middles of a cell's edges, about its first corner.
constexpr std::array<Vec3f, kCellEdges> kMiddles = [] {
    std::array<Vec3f, kCellEdges> middles{};
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        for (std::size_t a = 0; a < 3; ++a)
            middles[e][a] =
                0.5f * static_cast<float>((kEdgeCorners[e][0] >> a & 1) + (kEdgeCorners[e][1] >> a & 1));
    }
    return middles;
}();

// The mean of some edges' middles in a cell.
template <class Has>
Vec3f mean_of_edges(const Vec3f& cell, const Has& has) {
    Vec3f sum{};
    float count = 0;
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        if (!has(e)) continue;
        for (std::size_t a = 0; a < 3; ++a) sum[a] += kMiddles[e][a];
        ++count;
    }
    for (std::size_t a = 0; a < 3; ++a) sum[a] = cell[a] + sum[a] / count;
    return sum;
}

// The volume's index coordinates of a cell's first corner.
Vec3f corner_of(const Index3& cell) {
    return {static_cast<float>(cell[0] - 1), static_cast<float>(cell[1] - 1),
            static_cast<float>(cell[2] - 1)};
}

struct PlacedCell {
    Index3 index;
    ComplexCell cell;
};

// Places the points of simple cells, and lists the others.
template <class T>
std::vector<PlacedCell> place_slice(const LabelReader<T>& labels, LabelNet& net, std::int64_t slice) {
    const auto& table = crossed_cells();
    std::vector<PlacedCell> complex;
    for_each_cell(net, slice, [&](std::uint32_t id, const Index3& cell, unsigned mask) {
        const CrossedCell& crossed = table[mask];
        const Vec3f corner = corner_of(cell);
        net.points[id] = {corner[0] + crossed.centre[0], corner[1] + crossed.centre[1],
                          corner[2] + crossed.centre[2]};
        // A point on a line where three labels or more meet moves along that line alone.
        const bool on_line = __builtin_popcount(crossed.junctions) >= 2;
        net.joined[id] = on_line ? crossed.junctions : crossed.faces;
        if (crossed.simple) return;
        std::array<std::int64_t, 8> corners;
        for (std::size_t r = 0; r < 4; ++r) {
            const T* row = labels.row(cell[1] + (r & 1), cell[2] + (r >> 1));
            corners[2 * r] = static_cast<std::int64_t>(labels.at(row, cell[0]));
            corners[2 * r + 1] = static_cast<std::int64_t>(labels.at(row, cell[0] + 1));
        }
        CellPatches patches = patches_of(corners);
        if (patches.simple) return;
        net.joined[id] = 0;
        complex.push_back({cell, {id, 0, {}, patches}});
    });
    return complex;
}

// Numbers and places the points of complex cells beyond their first.
void place_complex(LabelNet& net, std::vector<std::vector<PlacedCell>>& slices) {
    std::uint64_t next = net.points.size();
    for (auto& slice : slices) {
        for (PlacedCell& placed : slice) {
            ComplexCell& cell = placed.cell;
            cell.more = static_cast<std::uint32_t>(next);
            next += static_cast<std::uint64_t>(cell.patches.points - 1);
            for (std::size_t a = 0; a < 3; ++a) {
                const auto& knot = cell.patches.knot[2 * a];
                if (std::none_of(knot.begin(), knot.end(), [](int k) { return k >= 0; })) continue;
                cell.knots[a] = static_cast<std::uint32_t>(next);
                next += 2;
            }
            if (next > std::numeric_limits<std::uint32_t>::max()) throw_too_many(next);
        }
    }
    net.points.resize(next);
    for (const auto& slice : slices) {
        for (const PlacedCell& placed : slice) {
            const ComplexCell& cell = placed.cell;
            const Vec3f corner = corner_of(placed.index);
            for (int p = 0; p < cell.patches.points; ++p) {
                const std::int8_t patch = cell.patches.patch_of_point[static_cast<std::size_t>(p)];
                net.points[cell.point(p)] = mean_of_edges(
                    corner, [&](std::size_t e) { return cell.patches.patch_of_edge[e] == patch; });
            }
            for (std::size_t a = 0; a < 3; ++a) {
                for (std::uint32_t knot = 0; cell.knots[a] != 0 && knot < 2; ++knot) {
                    net.points[cell.knots[a] + knot] = mean_of_edges(corner, [&](std::size_t e) {
                        return cell.patches.knot[2 * a][e] == static_cast<std::int8_t>(knot);
                    });
                }
            }
            net.complex_cells.push_back(cell);
            net.complex_number[cell.id] = static_cast<std::uint32_t>(net.complex_cells.size());
        }
    }
}

}  // namespace

template <class T>
LabelNet make_net(const LabelReader<T>& labels, const Progress& progress) {
    const auto slices = static_cast<std::size_t>(labels.dims[2] + 1);
    Stage stage(progress, 0, 0.3, 2 * slices);
    LabelNet net{BorderBits(labels.dims), {}, {}, {}, {}, {}};
    mark_borders(labels, net.bits, stage);
    net.before.resize(net.bits.active.size());
    number_cells(net);
    std::vector<std::vector<PlacedCell>> complex(slices);
    tbb::parallel_for(std::size_t{0}, slices, [&](std::size_t k) {
        complex[k] = place_slice(labels, net, static_cast<std::int64_t>(k));
        stage.step();
    });
    place_complex(net, complex);
    return net;
}

template LabelNet make_net(const LabelReader<std::uint8_t>&, const Progress&);
template LabelNet make_net(const LabelReader<std::int8_t>&, const Progress&);
template LabelNet make_net(const LabelReader<std::uint16_t>&, const Progress&);
template LabelNet make_net(const LabelReader<std::int16_t>&, const Progress&);
template LabelNet make_net(const LabelReader<std::int32_t>&, const Progress&);
template LabelNet make_net(const LabelReader<float>&, const Progress&);
template LabelNet make_net(const LabelReader<double>&, const Progress&);

}  // namespace marrow::internal
