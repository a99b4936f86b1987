#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "label_emit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "label_emit.h"
#include "label_patches.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Takes the points of a row of cells into space. The cells' middles are in double precision; no fused operations, so that the
// numbers are the same on every processor.
class RowFrame {
  public:
    RowFrame(const Frame& frame, std::int64_t j, std::int64_t k) {
        for (std::size_t r = 0; r < 3; ++r) {
            // The middle of cell (0, j, k); its first corner is sample (-1, j - 1, k - 1) of the volume.
            base_[r] = frame.origin[r] - 0.5 * frame.exact[r][0] +
                       frame.exact[r][1] * (static_cast<double>(j) - 0.5) +
                       frame.exact[r][2] * (static_cast<double>(k) - 0.5);
            along_[r] = frame.exact[r][0];
            for (std::size_t a = 0; a < 3; ++a) axes_[a][r] = frame.matrix[r][a];
        }
    }
    HWY_INLINE void to_space(std::int64_t i, NetPoint& point) const {
        const hn::CappedTag<double, 4> d;
        const hn::Rebind<float, decltype(d)> single;
        const NetPoint from = point;
        const auto cell = hn::Set(d, static_cast<double>(i));
        for (std::size_t r = 0; r < 4; r += hn::Lanes(d)) {
            auto about = hn::Mul(hn::Load(single, axes_[0] + r), hn::Set(single, from.at[0]));
            for (std::size_t a = 1; a < 3; ++a)
                about = hn::Add(about, hn::Mul(hn::Load(single, axes_[a] + r), hn::Set(single, from.at[a])));
            const auto middle = hn::Add(hn::Load(d, base_ + r), hn::Mul(hn::Load(d, along_ + r), cell));
            hn::Store(hn::DemoteTo(single, hn::Add(middle, hn::PromoteTo(d, about))), single, point.at + r);
        }
    }

  private:
    alignas(32) double base_[4] = {}, along_[4] = {};
    alignas(16) float axes_[3][4] = {};
};

void place_points_of_row(LabelNet& net, const Frame& frame, bool relaxed, std::int64_t j, std::int64_t k,
                         PointWriter* writers) {
    const BorderBits& bits = net.bits;
    const CellRow row(bits, j, k);
    if (row.first == bits.first_of_row[bits.row_number(j, k) + 1]) return;
    const RowFrame row_frame(frame, j, k);
    const std::array<PlainCase, 128>& cases = plain_cases();
    for (std::size_t w = 0; w < bits.words; ++w) {
        for (std::uint64_t left = row.active[w] & ~row.complex[w]; left != 0; left &= left - 1) {
            const std::uint32_t id = row.id(w, (left & -left) - 1);
            NetPoint& point = net.points[id];
            if (!relaxed) point = cases[net.shapes[id]].at;
            row_frame.to_space(static_cast<std::int64_t>(64 * w) + __builtin_ctzll(left), point);
            const CellPlaces places = net.places[id];
            auto& number = net.numbers[id].number;
            number[0] = writers[places.lesser()].write(point);
            number[1] = writers[places.greater()].write(point);
        }
    }
}

void place_points_of_piece(LabelNet& net, const Frame& frame, bool relaxed, std::size_t piece_number,
                           PointWriter* writers) {
    NetPiece& piece = net.pieces[piece_number];
    const std::int64_t first = static_cast<std::int64_t>(piece_number) * NetPiece::kSlices;
    for (std::int64_t k = first; k < std::min(first + NetPiece::kSlices, net.bits.dims[2] + 1); ++k) {
        for (std::int64_t j = 0; j <= net.bits.dims[1]; ++j)
            place_points_of_row(net, frame, relaxed, j, k, writers);
    }
    for (const ComplexCell& cell : piece.complex) {
        const RowFrame row_frame(frame, cell.index[1], cell.index[2]);
        const CellPattern& pattern = *cell.pattern;
        NetPoint& first_point = net.points[cell.id];
        if (!relaxed) first_point = pattern.at[0];
        row_frame.to_space(cell.index[0], first_point);
        for (std::size_t p = 1; p < pattern.at.size(); ++p)
            row_frame.to_space(cell.index[0], piece.more[cell.first_more + p - 1]);
        for (std::size_t o = 0; o < pattern.owns.size(); ++o) {
            const CellPattern::Own& own = pattern.owns[o];
            const NetPoint& point =
                own.number == 0 ? first_point : piece.more[cell.first_more + own.number - 1];
            piece.numbers[cell.first_own + o] = writers[cell.place_of_label[own.label]].write(point);
        }
    }
}

// The patches of grid edges, row by row.
class RowPatches {
  public:
    RowPatches(const LabelNet& net, bool mirrored, TriangleWriter* writers)
        : net_(net), mirrored_(mirrored), writers_(writers), complex_(net, mirrored, writers) {}

    void make_row(std::int64_t j, std::int64_t k) {
        const BorderBits& bits = net_.bits;
        // Rows of cells round the row of samples; where there is none, no edge that it is beside is crossed.
        const std::int64_t lower_j = std::max<std::int64_t>(j - 1, 0),
                           lower_k = std::max<std::int64_t>(k - 1, 0);
        const CellRow rows[4] = {CellRow(bits, lower_j, lower_k), CellRow(bits, j, lower_k),
                                 CellRow(bits, lower_j, k), CellRow(bits, j, k)};
        complex_.move_to(lower_k, k);
        std::uint64_t carry_y = 0, carry_z = 0;  // whether the cells before the word are complex
        const std::size_t row = bits.row(j, k);
        for (std::size_t w = 0; w < bits.words; ++w) {
            const std::uint64_t here = rows[3].complex[w], below_y = here | rows[1].complex[w],
                                below_z = here | rows[2].complex[w];
            if (const std::uint64_t crossed = bits.crossed[0][row + w]; crossed != 0) {
                const std::uint64_t complex = below_y | below_z | rows[0].complex[w];
                const auto ids = [&](std::uint64_t below) {
                    return EdgeCells{rows[0].id(w, below), rows[1].id(w, below), rows[3].id(w, below),
                                     rows[2].id(w, below)};
                };
                make<0>(crossed, complex, ids);
            }
            if (const std::uint64_t crossed = bits.crossed[1][row + w]; crossed != 0) {
                const auto ids = [&](std::uint64_t below) {
                    const std::uint32_t lower = rows[1].id(w, below), upper = rows[3].id(w, below);
                    return EdgeCells{lower - 1, upper - 1, upper, lower};
                };
                make<1>(crossed, below_y | below_y << 1 | carry_y, ids);
            }
            if (const std::uint64_t crossed = bits.crossed[2][row + w]; crossed != 0) {
                const auto ids = [&](std::uint64_t below) {
                    const std::uint32_t lower = rows[2].id(w, below), upper = rows[3].id(w, below);
                    return EdgeCells{lower - 1, lower, upper, upper - 1};
                };
                make<2>(crossed, below_z | below_z << 1 | carry_z, ids);
            }
            carry_y = below_y >> 63;
            carry_z = below_z >> 63;
        }
    }

  private:
    // `ids` gives the cells round an edge by the bits below its own.
    template <std::size_t kAxis, class Ids>
    HWY_INLINE void make(std::uint64_t crossed, std::uint64_t complex, const Ids& ids) {
        for (std::uint64_t left = crossed & ~complex; left != 0; left &= left - 1)
            make_plain(ids((left & -left) - 1));
        for (std::uint64_t left = crossed & complex; left != 0; left &= left - 1)
            complex_.add(kAxis, ids((left & -left) - 1));
    }

    HWY_INLINE void make_plain(const EdgeCells& round) {
        const EdgeCells ids = from_shorter_diagonal(net_.points.data(), round);
        // The numbers of both labels, which are together in memory, from four cells.
        using Two = std::uint64_t __attribute__((vector_size(16)));
        const auto numbers = [&](std::size_t c) {
            std::uint64_t both;
            std::memcpy(&both, &net_.numbers[ids[c]], sizeof both);
            return both;
        };
        const auto some = reinterpret_cast<Corners>(Two{numbers(0), numbers(1)}),
                   others = reinterpret_cast<Corners>(Two{numbers(2), numbers(3)});
        const Corners lesser = __builtin_shufflevector(some, others, 0, 2, 4, 6),
                      greater = __builtin_shufflevector(some, others, 1, 3, 5, 7);
        // The edge begins at corner 0 of the third cell.
        const CellPlaces places = net_.places[round[2]];
        const bool turned = (places.corner > places.other) != mirrored_;
        writers_[turned ? places.greater() : places.lesser()].add(turned ? greater : lesser);
        writers_[turned ? places.lesser() : places.greater()].add_turned(turned ? lesser : greater);
    }

    const LabelNet& net_;
    const bool mirrored_;
    TriangleWriter* writers_;
    ComplexPatches complex_;
};

void make_triangles_of_piece(const LabelNet& net, bool mirrored, std::size_t piece, TriangleWriter* writers) {
    RowPatches patches(net, mirrored, writers);
    const std::int64_t first = static_cast<std::int64_t>(piece) * NetPiece::kSlices;
    for (std::int64_t k = first; k < std::min(first + NetPiece::kSlices, net.bits.dims[2] + 1); ++k) {
        for (std::int64_t j = 0; j <= net.bits.dims[1]; ++j) patches.make_row(j, k);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <tbb/parallel_for.h>

namespace marrow::internal {
namespace {

HWY_EXPORT(place_points_of_piece);
HWY_EXPORT(make_triangles_of_piece);

std::uint64_t triangles_of(const NetPiece::Count& count) {
    return 2 * (count.quarters / 4) + count.triangles;
}

}  // namespace

std::vector<Mesh> allocate_meshes(const LabelNet& net, Place background) {
    std::vector<Mesh> meshes(net.values.size());
    std::vector<NetPiece::Count> totals(net.values.size());
    for (const NetPiece& piece : net.pieces) {
        for (std::size_t place = 0; place < totals.size(); ++place) {
            totals[place].points += piece.counts[place].points;
            totals[place].triangles += triangles_of(piece.counts[place]);
        }
    }
    for (std::size_t place = 0; place < totals.size(); ++place) {
        if (place == background) continue;
        meshes[place].points.resize(totals[place].points);
        meshes[place].triangles.resize(totals[place].triangles);
    }
    return meshes;
}

void place_points(LabelNet& net, const Frame& frame, Place background, std::vector<Mesh>& meshes,
                  Stage& stage) {
    const bool relaxed = !net.points.empty();
    if (!relaxed) net.points.resize(net.places.size());
    const std::size_t labels = net.values.size();
    std::vector<std::vector<std::uint32_t>> first(net.pieces.size(), std::vector<std::uint32_t>(labels));
    for (std::size_t p = 1; p < net.pieces.size(); ++p) {
        for (std::size_t place = 0; place < labels; ++place)
            first[p][place] =
                first[p - 1][place] + static_cast<std::uint32_t>(net.pieces[p - 1].counts[place].points);
    }
    tbb::parallel_for(std::size_t{0}, net.pieces.size(), [&](std::size_t p) {
        Vec3f dropped;
        std::vector<PointWriter> writers(labels);
        for (std::size_t place = 0; place < labels; ++place)
            writers[place] = {meshes[place].points.data(), first[p][place], 1};
        writers[background] = {&dropped, 0, 0};
        HWY_DYNAMIC_DISPATCH(place_points_of_piece)(net, frame, relaxed, p, writers.data());
        stage.step();
    });
}

void make_triangles(const LabelNet& net, bool mirrored, Place background, std::vector<Mesh>& meshes,
                    Stage& stage) {
    const std::size_t labels = net.values.size();
    std::vector<std::vector<std::uint64_t>> first(net.pieces.size(), std::vector<std::uint64_t>(labels));
    for (std::size_t p = 1; p < net.pieces.size(); ++p) {
        for (std::size_t place = 0; place < labels; ++place)
            first[p][place] = first[p - 1][place] + triangles_of(net.pieces[p - 1].counts[place]);
    }
    tbb::parallel_for(std::size_t{0}, net.pieces.size(), [&](std::size_t p) {
        std::array<Triangle, 2> dropped;
        std::vector<TriangleWriter> writers(labels);
        for (std::size_t place = 0; place < labels; ++place)
            writers[place] = {meshes[place].triangles.data() + first[p][place], 1};
        writers[background] = {dropped.data(), 0};
        HWY_DYNAMIC_DISPATCH(make_triangles_of_piece)(net, mirrored, p, writers.data());
        stage.step();
    });
}

}  // namespace marrow::internal
#endif
