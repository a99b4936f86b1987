// Places several triangles at once. Highway compiles this file once for each SIMD target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/intersections/triangle_blocks.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "mesh/geometry/triangle_corners.h"
#include "triangle_blocks.h"

#include "base/parallel.h"
#include "mesh/geometry/load_points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kMostLanes = 16;
using D = hn::CappedTag<float, kMostLanes>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;

// The sides that triangles show along each axis. Both, if rounding could be wrong.
HWY_INLINE VI sides_of(const V (&a)[3], const V (&b)[3], const V (&c)[3]) {
    const D d;
    const DI di;
    VI sides = hn::Zero(di);
    const auto add_unless = [&](auto mask, int bit) HWY_ATTR {
        sides = hn::Or(sides, hn::IfThenElseZero(hn::RebindMask(di, hn::Not(mask)), hn::Set(di, bit)));
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
        const V left = hn::Mul(hn::Sub(b[j], a[j]), hn::Sub(c[k], a[k])),
                right = hn::Mul(hn::Sub(b[k], a[k]), hn::Sub(c[j], a[j])), normal = hn::Sub(left, right);
        // More than what rounding changes in the differences and products, and what underflow loses.
        const V error =
            hn::Add(hn::Mul(hn::Set(d, 1e-6f), hn::Add(hn::Abs(left), hn::Abs(right))), hn::Set(d, 1e-36f));
        add_unless(hn::Lt(normal, hn::Neg(error)), kFront << axis);
        add_unless(hn::Gt(normal, error), kBack << axis);
    }
    return sides;
}

// Returns a bit for each lane.
template <class Tag, class Mask>
HWY_INLINE unsigned bits_of(Tag tag, const Mask& mask) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(tag, mask, bits);
    return bits[0] | static_cast<unsigned>(bits[1]) << 8;
}

// Whether triangles may and whether they certainly do meet a line. The line is perpendicular to the axes j
// and k; `from_line` is the way from it to the corners.
struct Meeting {
    hn::Mask<D> possible, certain;
};
HWY_INLINE Meeting meet_line(const V (&from_line)[3][3], std::size_t j, std::size_t k, V error) {
    V least, most;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto &p = from_line[c], &q = from_line[(c + 1) % 3];
        const V turn = hn::Sub(hn::Mul(p[j], q[k]), hn::Mul(p[k], q[j]));
        least = c == 0 ? turn : hn::Min(least, turn);
        most = c == 0 ? turn : hn::Max(most, turn);
    }
    const auto left = hn::Gt(least, error), right = hn::Lt(most, hn::Neg(error));
    const auto misses = hn::And(hn::Lt(least, hn::Neg(error)), hn::Gt(most, error));
    return {hn::Not(misses), hn::Or(left, right)};
}

// Places the triangles [begin, end), and marks the lines that they meet, except for large ones. Returns
// whether all triangles are within the bounds of the grid, as they are if all coordinates are finite.
bool place_triangles(const MeshView& mesh, std::size_t begin, std::size_t end, TriangleBlocks& found,
                     std::vector<TriangleBlocks::Mark>& marks, bool& has_large) {
    const D d;
    const DI di;
    const BlockGrid& grid = found.grid;
    const std::size_t lanes = hn::Lanes(d);
    const VI one = hn::Set(di, 1);
    const VI strides[3] = {one, hn::Set(di, static_cast<std::int32_t>(grid.blocks[0])),
                           hn::Set(di, static_cast<std::int32_t>(grid.blocks[0] * grid.blocks[1]))};
    const PointLoader points(mesh.points);
    auto outside = hn::Lt(hn::Zero(d), hn::Zero(d));
    auto any_large = hn::RebindMask(di, outside);
    for (std::size_t first = begin; first < end; first += lanes) {
        const std::size_t count = std::min(lanes, end - first);
        Triangle padded[kMostLanes];
        const Triangle* const triangles = in_all_lanes(&mesh.triangles[first], count, lanes, padded);
        V corners[3][3], from_line[3][3];
        for (std::size_t c = 0; c < 3; ++c) {
            points.load(
                d, [&](std::size_t lane) { return triangles[lane][c]; }, corners[c]);
        }
        VI block = hn::Zero(di), span = hn::Zero(di), to_line[3];
        auto is_large = hn::Lt(one, hn::Zero(di));
        decltype(is_large) has_line[3];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const V a = corners[0][axis], b = corners[1][axis], c = corners[2][axis];
            const V lower = hn::Min(hn::Min(a, b), c), upper = hn::Max(hn::Max(a, b), c);
            const V origin = hn::Set(d, grid.lower[axis]), scale = hn::Set(d, grid.halves_per_mm);
            const auto inside = hn::And(hn::Ge(lower, origin), hn::Le(upper, hn::Set(d, grid.upper[axis])));
            outside = hn::Or(outside, hn::Not(inside));
            const VI low = hn::ConvertTo(di, hn::Mul(hn::Sub(lower, origin), scale)),
                     high = hn::ConvertTo(di, hn::Mul(hn::Sub(upper, origin), scale));
            const VI more = hn::Sub(hn::ShiftRight<1>(high), hn::ShiftRight<1>(low));
            block = hn::Add(block, hn::Mul(strides[axis], hn::ShiftRight<1>(low)));
            span = hn::Or(span, hn::Mul(more, hn::Set(di, 1 << axis)));
            // The first line is in this block if the triangle begins in its first half.
            const VI is_in_next = hn::And(low, one);
            const VI lines =
                hn::Sub(hn::ShiftRight<1>(hn::Add(high, one)), hn::ShiftRight<1>(hn::Add(low, one)));
            has_line[axis] = hn::Gt(lines, hn::Zero(di));
            to_line[axis] = hn::Mul(strides[axis], is_in_next);
            const V halves = hn::ConvertTo(d, hn::Add(hn::Add(low, is_in_next), one));
            const V line = hn::Add(origin, hn::Mul(halves, hn::Set(d, grid.half_side)));
            for (std::size_t k = 0; k < 3; ++k) from_line[k][axis] = hn::Sub(corners[k][axis], line);
            is_large = hn::Or(is_large, hn::Or(hn::Gt(more, one), hn::Gt(lines, one)));
        }
        any_large = hn::Or(any_large, is_large);
        HWY_ALIGN std::int32_t spans[kMostLanes], sides[kMostLanes];
        hn::Store(hn::IfThenElse(is_large, hn::Set(di, -1),
                                 hn::Or(block, hn::ShiftLeft<BlockGrid::kIndexBits>(span))),
                  di, spans);
        hn::Store(sides_of(corners[0], corners[1], corners[2]), di, sides);
        for (std::size_t lane = 0; lane < count; ++lane) {
            found.spans[first + lane] = static_cast<std::uint32_t>(spans[lane]);
            found.sides[first + lane] = static_cast<std::uint8_t>(sides[lane]);
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
            const Meeting meeting = meet_line(from_line, j, k, hn::Set(d, grid.turn_error[axis]));
            const auto has_both = hn::AndNot(is_large, hn::And(has_line[j], has_line[k]));
            const unsigned possible =
                bits_of(di, hn::And(has_both, hn::RebindMask(di, meeting.possible))) & ((1u << count) - 1);
            const unsigned certain = bits_of(d, meeting.certain);
            HWY_ALIGN std::int32_t blocks[kMostLanes];
            hn::Store(hn::Add(block, hn::Add(to_line[j], to_line[k])), di, blocks);
            for (unsigned left = possible; left != 0; left &= left - 1) {
                const int lane = std::countr_zero(left);
                const int bits = (certain >> lane & 1) != 0 ? kOnLine : kOnLine | kMoreOnLine;
                marks.push_back(
                    {static_cast<std::uint32_t>(blocks[lane]), static_cast<BlockBits>(bits << axis)});
            }
        }
    }
    has_large = !hn::AllFalse(di, any_large);
    return hn::AllFalse(d, outside);
}

// For some of the blocks, the kinds of spans from there on that have a block with 1 in `wanted`: a bit for
// each. A plain loop, which compilers turn into vectors.
void find_wanted_kinds(const BlockGrid& grid, const std::uint8_t* wanted, std::size_t begin, std::size_t end,
                       std::uint8_t* kinds) {
    const std::uint8_t* const next[8] = {wanted,
                                         wanted + grid.index({1, 0, 0}),
                                         wanted + grid.index({0, 1, 0}),
                                         wanted + grid.index({1, 1, 0}),
                                         wanted + grid.index({0, 0, 1}),
                                         wanted + grid.index({1, 0, 1}),
                                         wanted + grid.index({0, 1, 1}),
                                         wanted + grid.index({1, 1, 1})};
    for (std::size_t b = begin; b < end; ++b) {
        // The kinds with this block.
        const int all = next[0][b] * 0b11111111 | next[1][b] * 0b10101010 | next[2][b] * 0b11001100 |
                        next[3][b] * 0b10001000 | next[4][b] * 0b11110000 | next[5][b] * 0b10100000 |
                        next[6][b] * 0b11000000 | next[7][b] * 0b10000000;
        kinds[b] = static_cast<std::uint8_t>(all);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(place_triangles);
HWY_EXPORT(find_wanted_kinds);

namespace {

double mean_edge(const MeshView& mesh) {
    const std::size_t step = 1 + mesh.triangles.size() / 4096;
    double sum = 0, count = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += step, ++count) {
        const Triangle& corners = mesh.triangles[t];
        sum += length(to_double(mesh.points[corners[1]]) - to_double(mesh.points[corners[0]]));
    }
    return sum / count;
}

// Returns nothing if there are no blocks of a suitable size.
std::optional<BlockGrid> make_grid(const MeshView& mesh) {
    constexpr double kBlockEdges = 1.5;     // the side of a block, in edges of triangles
    constexpr double kMostPerTriangle = 5;  // blocks
    constexpr float kMostHalves = 1 << 22;
    const Bounds bounds = bounds_of_triangles(mesh);
    BlockGrid grid{.lower = bounds.lower, .upper = bounds.upper};
    double side = kBlockEdges * mean_edge(mesh);
    const double most = std::min(kMostPerTriangle * static_cast<double>(mesh.triangles.size()),
                                 std::ldexp(1, BlockGrid::kIndexBits) - 1);
    for (double size = 2 * most; size > most; side *= std::max(1.01, std::cbrt(size / most))) {
        grid.halves_per_mm = static_cast<float>(2 / side);
        grid.half_side = static_cast<float>(side / 2);
        size = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float extent = bounds.upper[axis] - bounds.lower[axis];
            if (!(extent * grid.halves_per_mm < kMostHalves)) return {};
            grid.blocks[axis] = grid.half_block(axis, bounds.upper[axis]) / 2 + 1;
            // Some more that stay empty, so that loops over long rows only have whole vectors.
            constexpr std::uint32_t kLanes = 16;
            if (axis == 0 && grid.blocks[0] > kLanes)
                grid.blocks[0] = (grid.blocks[0] + kLanes - 1) / kLanes * kLanes;
            size *= grid.blocks[axis];
            // Differences and products round, and a line is between two successive floats.
            const float furthest = std::max(std::abs(bounds.lower[axis]), std::abs(bounds.upper[axis]));
            grid.line_error[axis] = 3e-7 * (double{extent} + double{furthest});
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double error = grid.line_error[(axis + 1) % 3] + grid.line_error[(axis + 2) % 3];
            grid.turn_error[axis] = static_cast<float>(4 * side * error + 1e-5 * side * side);
        }
    }
    return grid;
}

// What is known of the block whose line along an axis may meet a triangle. `at` is where the
// line is on the two other axes.
BlockBits meet(const TriangleCorners& corners, const BlockGrid& grid, std::size_t axis,
               const std::array<double, 2>& at) {
    const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
    int left = 0, right = 0;  // the edges that the line is certainly on these sides of
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec3d &from = corners[c], edge = corners[(c + 1) % 3] - from;
        const double turn = edge[j] * (at[1] - from[k]) - edge[k] * (at[0] - from[j]);
        const double error =
            2 * (std::abs(edge[j]) * grid.line_error[k] + std::abs(edge[k]) * grid.line_error[j]);
        left += turn > error ? 1 : 0;
        right += turn < -error ? 1 : 0;
    }
    if (left > 0 && right > 0) return 0;
    return static_cast<BlockBits>((left + right == 3 ? kOnLine : kOnLine | kMoreOnLine) << axis);
}

// Marks the lines through the middle of blocks that a triangle meets.
void mark_lines(const MeshView& mesh, const BlockGrid& grid, const Triangle& triangle,
                const BlockReach& reach, std::vector<TriangleBlocks::Mark>& marks) {
    const TriangleCorners corners = corners_of(mesh, triangle);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
        std::array<std::uint32_t, 3> block;
        block[axis] = reach.low[axis] / 2;
        for (block[j] = (reach.low[j] + 1) / 2; 2 * block[j] < reach.high[j]; ++block[j]) {
            for (block[k] = (reach.low[k] + 1) / 2; 2 * block[k] < reach.high[k]; ++block[k]) {
                const BlockBits bits =
                    meet(corners, grid, axis, {grid.line(j, block[j]), grid.line(k, block[k])});
                if (bits != 0) marks.push_back({grid.index(block), bits});
            }
        }
    }
}

void mark_blocks(const BlockGrid& grid, const BlockReach& reach, BlockBits sides,
                 std::vector<TriangleBlocks::Mark>& marks) {
    reach.for_each_block([&](const std::array<std::uint32_t, 3>& block) {
        int bits = sides;
        for (std::size_t axis = 0; axis < 3; ++axis)
            bits |= block[axis] < reach.high[axis] / 2 ? kLinked << axis : 0;
        marks.push_back({grid.index(block), static_cast<BlockBits>(bits)});
    });
}

bool has_only_fans(const OneRings& rings) {
    for (std::size_t chunk = 0; chunk < rings.chunks(); ++chunk) {
        if (!rings.listed(chunk, 0).empty()) return false;
    }
    return true;
}

// Lets triangles at points that are no fans show both sides along all axes. Without branches, which
// takes half as long.
void show_both_sides_without_fans(const MeshView& mesh, const OneRings& rings, std::size_t begin,
                                  std::size_t end, std::uint8_t* sides) {
    for (std::size_t t = begin; t < end; ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        const int fans = int{rings.is_fan(a)} & int{rings.is_fan(b)} & int{rings.is_fan(c)};
        sides[t] = static_cast<std::uint8_t>(sides[t] | ((fans - 1) & (kAllAxes * (kFront | kBack))));
    }
}

constexpr std::size_t kSection = 4096;  // triangles

}  // namespace

std::optional<TriangleBlocks> find_triangle_blocks(const MeshView& mesh, const OneRings& rings) {
    constexpr std::size_t kMostInLarge = 4;  // blocks of large triangles, for each triangle of the mesh
    const std::optional<BlockGrid> grid = make_grid(mesh);
    if (!grid) return {};
    const std::size_t triangles = mesh.triangles.size();
    const std::size_t sections = (triangles + kSection - 1) / kSection;
    TriangleBlocks found{*grid, Buffer<std::uint32_t>(triangles), Buffer<std::uint8_t>(triangles),
                         std::vector<std::vector<TriangleBlocks::Mark>>(sections)};
    std::atomic<std::size_t> marked = 0;
    std::atomic<bool> failed = false;
    const bool all_fans = has_only_fans(rings);
    parallel_for(std::size_t{0}, sections, [&](std::size_t section) {
        if (failed) return;
        const std::size_t begin = section * kSection, end = std::min(begin + kSection, triangles);
        std::vector<TriangleBlocks::Mark>& marks = found.marks[section];
        marks.reserve(end - begin);
        bool has_large = false;
        if (!HWY_DYNAMIC_DISPATCH(place_triangles)(mesh, begin, end, found, marks, has_large)) failed = true;
        if (!all_fans) show_both_sides_without_fans(mesh, rings, begin, end, found.sides.data());
        if (!has_large) return;
        for (std::size_t t = begin; t < end && !failed; ++t) {
            if (found.spans[t] != TriangleBlocks::kLarge) continue;
            const BlockReach reach(mesh, found.grid, mesh.triangles[t]);
            if ((marked += reach.blocks()) > kMostInLarge * triangles) failed = true;
            if (failed) return;
            mark_blocks(found.grid, reach, found.sides[t], marks);
            mark_lines(mesh, found.grid, mesh.triangles[t], reach, marks);
        }
    });
    if (failed) return {};
    return found;
}

Buffer<std::uint32_t> triangles_in(const TriangleBlocks& blocks, const Buffer<std::uint8_t>& wanted) {
    const std::size_t size = blocks.grid.size();
    Buffer<std::uint8_t> kinds(size + 1);
    parallel_for_ranges(std::size_t{0}, size, 65536, [&](const auto& range) {
        HWY_DYNAMIC_DISPATCH(find_wanted_kinds)
        (blocks.grid, wanted.data(), range.begin(), range.end(), kinds.data());
    });
    kinds[size] = 0xff;  // for large triangles, whose spans begin beyond all blocks
    const std::size_t triangles = blocks.spans.size();
    Buffer<std::uint32_t> listed(triangles);
    std::vector<std::size_t> counts((triangles + kSection - 1) / kSection);
    parallel_for(std::size_t{0}, counts.size(), [&](std::size_t section) {
        const std::size_t begin = section * kSection, end = std::min(begin + kSection, triangles);
        std::size_t count = 0;
        for (std::size_t t = begin; t < end; ++t) {
            const std::uint32_t span = blocks.spans[t];
            const std::size_t first = std::min<std::size_t>(SpanRows::first(span), size);
            listed[begin + count] = static_cast<std::uint32_t>(t);
            count += kinds[first] >> SpanRows::kind(span) & 1;
        }
        counts[section] = count;
    });
    std::size_t count = 0;
    for (std::size_t section = 0; section < counts.size(); ++section) {
        std::copy_n(listed.data() + section * kSection, counts[section], listed.data() + count);
        count += counts[section];
    }
    listed.resize(count);
    return listed;
}

}  // namespace marrow::internal
#endif
