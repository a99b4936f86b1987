#include "label_net.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "case_table.h"

namespace marrow::internal {
namespace {

// Sets bits 1 to count where a and b differ.
template <class T>
void mark_differences(const T* a, const T* b, std::int64_t count, std::uint64_t* words) {
    for (std::int64_t s = 0, w = 0; s < count; ++w) {
        const std::int64_t end = std::min(count, 64 * w + 63);  // word w's bit 0 belongs to sample 64 w - 1
        const auto size = static_cast<std::size_t>(end - s);
        if (std::memcmp(a + s, b + s, size * sizeof(T)) != 0) {
            std::uint8_t differs[64] = {};
            for (std::size_t i = 0; i < size; ++i)
                differs[i] = a[s + static_cast<std::int64_t>(i)] != b[s + static_cast<std::int64_t>(i)];
            std::uint64_t bits = 0;
            for (int byte = 0; byte < 8; ++byte) {  // the product gathers eight bytes' lowest bits
                std::uint64_t eight;
                std::memcpy(&eight, differs + 8 * byte, 8);
                bits |= (eight * 0x0102040810204080u >> 56) << (8 * byte);
            }
            words[w] |= w == 0 ? bits << 1 : bits;
        }
        s = end;
    }
}

template <class T>
void mark_borders(const LabelReader<T>& labels, BorderBits& bits, Stage& stage) {
    const auto [nx, ny, nz] = labels.dims;
    const std::vector<T> outside(static_cast<std::size_t>(nx), labels.background);
    const auto samples = [&](std::int64_t j, std::int64_t k) {
        const T* row = labels.row(j, k);
        return row != nullptr ? row : outside.data();
    };
    tbb::parallel_for(std::int64_t{0}, nz + 1, [&, nx = nx, ny = ny, nz = nz](std::int64_t k) {
        for (std::int64_t j = 0; j <= ny; ++j) {
            const std::size_t row = bits.row(j, k);
            const T* here = samples(j, k);
            if (k >= 1) mark_differences(here, samples(j + 1, k), nx, &bits.crossed[1][row]);
            if (j >= 1) mark_differences(here, samples(j, k + 1), nx, &bits.crossed[2][row]);
            if (j < 1 || k < 1) continue;
            std::uint64_t* along = &bits.crossed[0][row];
            mark_differences(here, here + 1, nx - 1, along);
            along[0] |= std::uint64_t{here[0] != labels.background};
            along[nx >> 6] |= std::uint64_t{here[nx - 1] != labels.background} << (nx & 63);
        }
        stage.step();
    });
    // A cell is active unless its eight corners are alike: seven edges that join them all tell.
    tbb::parallel_for(std::int64_t{0}, nz + 1, [&, ny = ny](std::int64_t k) {
        const auto& [x, y, z] = bits.crossed;
        for (std::int64_t j = 0; j <= ny; ++j) {
            const std::size_t r = bits.row(j, k), next_j = bits.row(j + 1, k), next_k = bits.row(j, k + 1),
                              next_jk = bits.row(j + 1, k + 1);
            for (std::size_t w = 0; w < bits.words; ++w) {
                bits.active[r + w] = x[r + w] | x[next_j + w] | x[next_k + w] | x[next_jk + w] | y[r + w] |
                                     y[next_k + w] | z[r + w];
            }
        }
    });
}

// Calls f(id, {i, j, k}, mask of crossed edges) for the active cells of a slice.
template <class F>
void for_each_cell(const LabelNet& net, std::int64_t k, const F& f) {
    const BorderBits& bits = net.bits;
    for (std::int64_t j = 0; j <= bits.dims[1]; ++j) {
        const std::size_t row = bits.row(j, k);
        const CellRow cells(bits, j, k);
        for (std::size_t w = 0; w < bits.words; ++w) {
            std::uint32_t id = net.before[row + w];
            for (std::uint64_t active = bits.active[row + w]; active != 0; active &= active - 1) {
                const std::int64_t i = static_cast<std::int64_t>(64 * w) + __builtin_ctzll(active);
                f(id++, Index3{i, j, k}, cells.mask(i));
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
    net.is_complex.assign(total, 0);
    net.points.resize(total);
}

Vec3f middle_of_edge(int e) {
    Vec3f m;
    for (std::size_t a = 0; a < 3; ++a)
        m[a] = 0.5f * static_cast<float>((kEdgeCorners[e][0] >> a & 1) + (kEdgeCorners[e][1] >> a & 1));
    return m;
}

// The mean of some edges' middles in a cell.
template <class Has>
Vec3f mean_of_edges(const Vec3f& cell, const Has& has) {
    Vec3f sum{};
    float count = 0;
    for (int e = 0; e < kCellEdges; ++e) {
        if (!has(static_cast<std::size_t>(e))) continue;
        const Vec3f m = middle_of_edge(e);
        for (std::size_t a = 0; a < 3; ++a) sum[a] += m[a];
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
        if (crossed.simple) return;
        std::array<std::int64_t, 8> corners;
        for (std::size_t r = 0; r < 4; ++r) {
            const T* row = labels.row(cell[1] + (r & 1), cell[2] + (r >> 1));
            corners[2 * r] = static_cast<std::int64_t>(labels.at(row, cell[0]));
            corners[2 * r + 1] = static_cast<std::int64_t>(labels.at(row, cell[0] + 1));
        }
        CellPatches patches = patches_of(corners);
        if (patches.simple()) return;
        net.is_complex[id] = 1;
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
        for (const auto& [index, cell] : slice) {
            const Vec3f corner = corner_of(index);
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
        }
    }
}

// The points that each point of a simple cell is joined with; none for those that stay.
struct Neighbours {
    float home[4];  // the middle of its cell
    std::array<std::uint32_t, 6> ids;
    std::uint32_t count = 0;
};

// The point of the cell behind face f, joined with this one through that face.
std::uint32_t point_behind(const LabelNet& net, std::size_t f, Index3 cell) {
    cell[f / 2] += f % 2 == 0 ? -1 : 1;
    const std::uint32_t id = net.first_point(cell[0], cell[1], cell[2]);
    if (net.is_complex[id] == 0) return id;
    // All crossed edges of the face are in one knot, so any of them tells the patch.
    const ComplexCell& other = net.complex_cell(id);
    for (std::size_t e = 0; e < kCellEdges; ++e) {
        const int side = f % 2 == 0 ? 1 : 0, axis = static_cast<int>(f / 2);
        const bool on_face =
            (kEdgeCorners[e][0] >> axis & 1) == side && (kEdgeCorners[e][1] >> axis & 1) == side;
        if (on_face && other.patches.patch_of_edge[e] >= 0)
            return other.point(other.patches.patch_of_edge[e]);
    }
    return id;
}

std::vector<Neighbours> find_neighbours(const LabelNet& net) {
    std::vector<Neighbours> neighbours(net.is_complex.size());
    const auto& table = crossed_cells();
    tbb::parallel_for(std::int64_t{0}, net.bits.dims[2] + 1, [&](std::int64_t slice) {
        for_each_cell(net, slice, [&](std::uint32_t id, const Index3& cell, unsigned mask) {
            if (net.is_complex[id] != 0) return;
            const CrossedCell& crossed = table[mask];
            // A point on a line where three labels or more meet moves along that line alone.
            const bool on_line = __builtin_popcount(crossed.junctions) >= 2;
            const unsigned faces = on_line ? crossed.junctions : crossed.faces;
            Neighbours& n = neighbours[id];
            const Vec3f corner = corner_of(cell);
            for (std::size_t a = 0; a < 3; ++a) n.home[a] = corner[a] + 0.5f;
            n.home[3] = 0;
            for (std::size_t f = 0; f < 6; ++f) {
                if ((faces >> f & 1) != 0) n.ids[n.count++] = point_behind(net, f, cell);
            }
        });
    });
    return neighbours;
}

}  // namespace

BorderBits::BorderBits(const Index3& volume_dims)
    : dims(volume_dims), words(static_cast<std::size_t>((volume_dims[0] + 2 + 63) / 64)) {
    const std::size_t size = row(0, dims[2] + 2);
    for (auto& bits : crossed) bits.assign(size, 0);
    active.assign(size, 0);
}

const ComplexCell& LabelNet::complex_cell(std::uint32_t id) const {
    return *std::lower_bound(complex_cells.begin(), complex_cells.end(), id,
                             [](const ComplexCell& cell, std::uint32_t wanted) { return cell.id < wanted; });
}

template <class T>
LabelNet make_net(const LabelReader<T>& labels, const Progress& progress) {
    const auto slices = static_cast<std::size_t>(labels.dims[2] + 1);
    Stage stage(progress, 0, 0.3, 2 * slices);
    LabelNet net{BorderBits(labels.dims), {}, {}, {}, {}};
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

void relax(LabelNet& net, int passes, const Progress& progress) {
    if (passes == 0) return;
    // Of the way to the mean of the neighbours, and in every other pass away from it, a little more, so that surfaces do not
    // shrink (Taubin 1995: what passes are waves of 10 % and less of the sharpest).
    constexpr float kSteps[] = {0.6307f, -0.6732f};
    constexpr float kReach = 0.45f;  // from the middle of the cell: points of neighbouring cells stay apart
    const std::vector<Neighbours> neighbours = find_neighbours(net);
    // Four numbers to a point are as quick as one; the fourth is not used.
    struct alignas(16) Point {
        float at[4];
    };
    Buffer<Point> from(net.points.size()), to(net.points.size());
    for (std::size_t p = 0; p < from.size(); ++p) {
        const Vec3f& at = net.points[p];
        from[p] = to[p] = {{at[0], at[1], at[2], 0}};
    }
    Stage stage(progress, 0.3, 0.6, static_cast<std::size_t>(passes));
    for (int pass = 0; pass < passes; ++pass) {
        const float step = kSteps[pass % 2];
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, neighbours.size(), 1 << 14), [&](const auto& range) {
                for (std::size_t p = range.begin(); p < range.end(); ++p) {
                    const Neighbours& n = neighbours[p];
                    if (n.count == 0) continue;
                    Point sum{};
                    for (std::uint32_t i = 0; i < n.count; ++i) {
                        const Point& other = from[n.ids[i]];
                        for (int a = 0; a < 4; ++a) sum.at[a] += other.at[a];
                    }
                    const float share = step / static_cast<float>(n.count);
                    const Point here = from[p];
                    Point there;
                    for (int a = 0; a < 4; ++a) {
                        const float home = n.home[a];  // the middle of its cell, which a point does not leave
                        const float moved = here.at[a] + (share * sum.at[a] - step * here.at[a]);
                        there.at[a] = std::min(std::max(moved, home - kReach), home + kReach);
                    }
                    to[p] = there;
                }
            });
        std::swap(from, to);
        stage.step();
    }
    for (std::size_t p = 0; p < from.size(); ++p)
        net.points[p] = {from[p].at[0], from[p].at[1], from[p].at[2]};
}

}  // namespace marrow::internal
