#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/surface_nets/relax.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <span>

#include "relax.h"

#ifndef MARROW_LABEL_RELAX_TYPES  // once for all targets
#define MARROW_LABEL_RELAX_TYPES
namespace marrow::internal {

// A point that moves, and the points that it is joined with; behind those the one that stands for none, at 0.
template <std::size_t kMost>
struct Joint {
    std::uint32_t point, faces;  // as CellPattern::joined
    std::array<std::uint32_t, kMost> with;
};

// Most points of a surface are joined with four others, in whatever directions.
struct Joints {
    Buffer<Joint<4>> few;
    std::size_t few_size = 0;
    Buffer<Joint<6>> many;
};

// By faces: those of them, and then kNone.
constexpr std::uint8_t kNone = 6;
constexpr std::array<std::array<std::uint8_t, 6>, 64> kOrders = [] {
    std::array<std::array<std::uint8_t, 6>, 64> orders{};
    for (std::size_t faces = 0; faces < orders.size(); ++faces) {
        orders[faces].fill(kNone);
        std::size_t count = 0;
        for (std::uint8_t f = 0; f < 6; ++f) {
            if ((faces >> f & 1) != 0) orders[faces][count++] = f;
        }
    }
    return orders;
}();

// What one pass does to points by the faces that they are joined through.
struct PassTable {
    float keep;  // of where a point is
    // Of the sum of the others: fourth; and what their cells are away from its own adds.
    std::array<NetPoint, 64> by_faces;
};

}  // namespace marrow::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <std::size_t kMost>
HWY_INLINE void relax_points(std::span<const Joint<kMost>> joints, const PassTable& table,
                             const NetPoint* from, NetPoint* to) {
    const hn::CappedTag<float, 4> d;
    constexpr float kReach = 0.45f;  // from the middle of the cell: points of neighbouring cells stay apart
    const auto keep = hn::Set(d, table.keep), reach = hn::Set(d, kReach), reach_down = hn::Set(d, -kReach);
    for (const Joint<kMost>& joint : joints) {
        const float* shift = table.by_faces[joint.faces].at;
#if HWY_TARGET == HWY_SCALAR
        const auto share = hn::Set(d, shift[3]);
#else
        const auto share = hn::Broadcast<3>(hn::Load(d, shift));  // loads are what takes the time
#endif
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            const auto at = [&](std::size_t n) { return hn::Load(d, from[joint.with[n]].at + i); };
            auto sum = hn::Add(hn::Add(at(0), at(1)), hn::Add(at(2), at(3)));
            if constexpr (kMost == 6) sum = hn::Add(sum, hn::Add(at(4), at(5)));
            const auto here = hn::Load(d, from[joint.point].at + i);
            const auto moved =
                hn::Add(hn::Add(hn::Mul(keep, here), hn::Mul(share, sum)), hn::Load(d, shift + i));
            hn::Store(hn::Min(hn::Max(moved, reach_down), reach), d, to[joint.point].at + i);
        }
    }
}

void relax_slice(const Joints& joints, const PassTable& table, const NetPoint* from, NetPoint* to) {
    relax_points(std::span<const Joint<4>>(joints.few.data(), joints.few_size), table, from, to);
    relax_points(std::span<const Joint<6>>(joints.many), table, from, to);
}

// Lists the points of rows of cells that move.
class Joiner {
  public:
    explicit Joiner(const LabelNet& net) : net_(net), none_(static_cast<std::uint32_t>(net.point_count())) {}

    void join_row(std::int64_t j, std::int64_t k, Joints& joints) const {
        const BorderBits& bits = net_.bits;
        const CellRow row(bits, j, k);
        if (row.first == bits.first_of_row[bits.row_number(j, k) + 1]) return;
        // Behind faces 2 to 5; where there is no row, none is joined.
        const CellRow beside[4] = {
            CellRow(bits, std::max<std::int64_t>(j - 1, 0), k), CellRow(bits, j + 1, k),
            CellRow(bits, j, std::max<std::int64_t>(k - 1, 0)), CellRow(bits, j, k + 1)};
        for (std::size_t w = 0; w < bits.words; ++w) {
            if (row.active[w] == 0) continue;
            const std::uint64_t complex = row.complex[w];
            std::uint64_t near = complex << 1 | complex >> 1;
            if (w > 0) near |= row.complex[w - 1] >> 63;
            if (w + 1 < bits.words) near |= row.complex[w + 1] << 63;
            for (const CellRow& other : beside) near |= other.complex[w];
            std::uint32_t id = row.first + row.before[w];
            for (std::uint64_t left = row.active[w]; left != 0; left &= left - 1, ++id) {
                const std::uint64_t bit = left & -left;
                std::array<std::uint32_t, 7> others = {id - 1, id + 1};
                others[kNone] = none_;
                for (std::size_t r = 0; r < 4; ++r) others[2 + r] = beside[r].id(w, bit - 1);
                const unsigned faces = (complex & bit) != 0 ? net_.complex_cell(k, id).pattern->joined
                                                            : cases_[net_.shapes[id]].joined;
                if ((near & bit) != 0) replace_complex(k, faces, others);
                add(id, faces, others, joints);
            }
        }
    }

  private:
    // A complex cell's point may be another than its first.
    HWY_NOINLINE void replace_complex(std::int64_t k, unsigned faces,
                                      std::array<std::uint32_t, 7>& others) const {
        for (std::size_t f = 0; f < 6; ++f) {
            if ((faces >> f & 1) == 0 || net_.shapes[others[f]] != 0) continue;
            const std::int64_t slice = f == 4 ? k - 1 : f == 5 ? k + 1 : k;
            const NetPiece& piece = net_.piece_of_slice(slice);
            const ComplexCell& cell = net_.complex_cell(slice, others[f]);
            // All crossed edges of the face are in one knot, so they have one point.
            const std::int8_t point = cell.pattern->point_of_face[f ^ 1];
            if (point > 0)
                others[f] = static_cast<std::uint32_t>(net_.places.size()) + piece.first_more +
                            cell.first_more + static_cast<std::uint32_t>(point - 1);
        }
    }
    HWY_INLINE void add(std::uint32_t id, unsigned faces, const std::array<std::uint32_t, 7>& others,
                        Joints& joints) const {
        const std::array<std::uint8_t, 6>& order = kOrders[faces];
        const auto with = [&](std::size_t n) { return others[order[n]]; };
        if (faces == 0) return;
        if (order[4] == kNone)
            joints.few[joints.few_size++] = {id, faces, {with(0), with(1), with(2), with(3)}};
        else
            joints.many.push_back({id, faces, {with(0), with(1), with(2), with(3), with(4), with(5)}});
    }

    const LabelNet& net_;
    const std::uint32_t none_;
    const std::array<PlainCase, 128>& cases_ = plain_cases();
};

void join_slice(const LabelNet& net, std::int64_t k, Joints& joints) {
    const Joiner joiner(net);
    for (std::int64_t j = 0; j <= net.bits.dims[1]; ++j) joiner.join_row(j, k, joints);
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace marrow::internal {
namespace {

constexpr int kPassesTogether = 4;

HWY_EXPORT(relax_slice);
HWY_EXPORT(join_slice);

// A step towards the mean of the others.
PassTable pass_table(float step) {
    PassTable table{1 - step, {}};
    for (unsigned faces = 1; faces < table.by_faces.size(); ++faces) {
        NetPoint& shift = table.by_faces[faces];
        const float share = step / static_cast<float>(__builtin_popcount(faces));
        for (std::size_t a = 0; a < 3; ++a) {
            const int upper = static_cast<int>(faces >> (2 * a + 1) & 1),
                      lower = static_cast<int>(faces >> (2 * a) & 1);
            shift.at[a] = share * static_cast<float>(upper - lower);
        }
        shift.at[3] = share;
    }
    return table;
}

}  // namespace

void relax(LabelNet& net, int passes, const Progress& progress) {
    if (passes == 0) return;
    // Of the way to the mean of the neighbours, and in every other pass away from it, a little more, so that surfaces do not
    // shrink (Taubin 1995: what passes are waves of 10 % and less of the sharpest).
    const PassTable tables[] = {pass_table(0.6307f), pass_table(-0.6732f)};
    const BorderBits& bits = net.bits;
    const std::int64_t slices = bits.dims[2] + 1;
    const std::size_t points = net.point_count();
    std::array<Buffer<NetPoint>, 2> at{Buffer<NetPoint>(points + 1), Buffer<NetPoint>(points + 1)};
    const auto put = [&](std::size_t point, const NetPoint& where) { at[0][point] = at[1][point] = where; };
    put(points, NetPoint{});
    const std::array<PlainCase, 128>& cases = plain_cases();
    tbb::parallel_for(std::size_t{0}, net.pieces.size(), [&](std::size_t p) {
        const NetPiece& piece = net.pieces[p];
        const std::int64_t first = static_cast<std::int64_t>(p) * NetPiece::kSlices,
                           end = std::min(first + NetPiece::kSlices, slices);
        for (std::size_t id = bits.first_of_row[bits.row_number(0, first)];
             id < bits.first_of_row[bits.row_number(0, end)]; ++id)
            put(id, cases[net.shapes[id]].at);
        for (const ComplexCell& cell : piece.complex) {
            const std::vector<NetPoint>& made = cell.pattern->at;
            put(cell.id, made[0]);
            for (std::size_t m = 1; m < made.size(); ++m)
                put(net.places.size() + piece.first_more + cell.first_more + m - 1, made[m]);
        }
    });
    std::vector<Joints> joints(static_cast<std::size_t>(slices));
    tbb::parallel_for(std::int64_t{0}, slices, [&](std::int64_t k) {
        const std::size_t begin = bits.first_of_row[bits.row_number(0, k)],
                          end = bits.first_of_row[bits.row_number(0, k + 1)];
        Joints& made = joints[static_cast<std::size_t>(k)];
        made.few.resize(end - begin);
        HWY_DYNAMIC_DISPATCH(join_slice)(net, k, made);
    });
    const auto relax_one = [&](std::int64_t k, int pass) {
        HWY_DYNAMIC_DISPATCH(relax_slice)
        (joints[static_cast<std::size_t>(k)], tables[pass % 2], at[pass % 2].data(), at[1 - pass % 2].data());
    };
    // A slice's next pass waits only for those on both sides of it. So a few passes follow each other closely through the slices,
    // while what they need is in the cache; and threads have bands of slices, of which they leave ever more at the borders that
    // others are beyond. Those are made up for afterwards.
    const std::int64_t bands = std::max<std::int64_t>(
        1, std::min<std::int64_t>(tbb::this_task_arena::max_concurrency(), slices / (2 * kPassesTogether)));
    const auto border = [&](std::int64_t band) { return slices * band / bands; };
    Stage stage(progress, 0.3, 0.6,
                static_cast<std::size_t>((passes + kPassesTogether - 1) / kPassesTogether));
    for (int first = 0; first < passes; first += kPassesTogether) {
        const int together = std::min(kPassesTogether, passes - first);
        tbb::parallel_for(std::int64_t{0}, bands, [&](std::int64_t band) {
            const std::int64_t begin = border(band), end = border(band + 1);
            for (std::int64_t front = begin; front < end + together; ++front) {
                for (int pass = 0; pass < together; ++pass) {
                    const std::int64_t k = front - pass;
                    if (k < begin + (band > 0 ? pass : 0)) continue;
                    if (k >= end - (band + 1 < bands ? pass : 0)) continue;
                    relax_one(k, first + pass);
                }
            }
        });
        tbb::parallel_for(std::int64_t{1}, bands, [&](std::int64_t band) {
            for (int pass = 1; pass < together; ++pass) {
                for (std::int64_t k = border(band) - pass; k < border(band) + pass; ++k)
                    relax_one(k, first + pass);
            }
        });
        stage.step();
    }
    net.points = std::move(at[static_cast<std::size_t>(passes % 2)]);
}

}  // namespace marrow::internal
#endif
