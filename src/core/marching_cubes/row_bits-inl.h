// Bit logic on the rows around a row of cells, 64 cells at a time. Each SIMD target includes this file once.
#if defined(MARROW_ROW_BITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_ROW_BITS_INL_H
#undef MARROW_ROW_BITS_INL_H
#else
#define MARROW_ROW_BITS_INL_H
#endif

#include <bit>
#include <cstdint>

#include "inside_bits.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::ScalableTag<std::uint64_t>;
using WordVec = hn::Vec<Words>;

// As std::popcount, but unsigned as all counts are.
HWY_INLINE std::uint32_t popcount(std::uint64_t bits) {
    return static_cast<std::uint32_t>(std::popcount(bits));
}

// A row of the grid, and its neighbours at (y + 1, z), (y, z + 1) and (y + 1, z + 1).
enum Row { kRow = 0, kNextY = 1, kNextZ = 2, kNextYZ = 3 };

// The four rows of samples around a row of cells. At the end of the grid, an existing row replaces a missing
// one, so that no edge towards it is crossed.
struct RowBits {
    const std::uint64_t* rows[4];
    std::size_t words;
    std::uint64_t last_valid;  // valid(w) of the last word
    bool has_cells;

    RowBits(const InsideBits& bits, const GridRow& row) : words(bits.words_per_row) {
        const bool last_y = row.y == bits.ny - 1, last_z = row.z == bits.nz - 1;
        const std::size_t step_y = last_y ? 0 : words;
        const std::size_t step_z = last_z ? 0 : words * static_cast<std::size_t>(bits.ny);
        rows[kRow] = bits.row(row.index);
        rows[kNextY] = rows[kRow] + step_y;
        rows[kNextZ] = rows[kRow] + step_z;
        rows[kNextYZ] = rows[kNextZ] + step_y;
        last_valid = bits.last_cells();
        has_cells = !last_y && !last_z;
    }

    // The bits of word w at which cells and edges along x start.
    std::uint64_t valid(std::size_t w) const { return w + 1 < words ? ~std::uint64_t{0} : last_valid; }
    // For each sample of word w, the next sample along x.
    std::uint64_t next_x(Row r, std::size_t w) const {
        const std::uint64_t carry = w + 1 < words ? rows[r][w + 1] : 0;
        return rows[r][w] >> 1 | carry << 63;
    }
    std::uint64_t crossed_x(Row r, std::size_t w) const { return (rows[r][w] ^ next_x(r, w)) & valid(w); }
    std::uint64_t crossed_y(std::size_t w) const { return rows[kRow][w] ^ rows[kNextY][w]; }
    std::uint64_t crossed_z(std::size_t w) const { return rows[kRow][w] ^ rows[kNextZ][w]; }
};

// Calls f(w) for each word that is marked in the masks of a row, in ascending order.
template <class F>
HWY_INLINE void for_each_marked_word(const std::uint64_t* masks, std::size_t masks_per_row, const F& f) {
    for (std::size_t m = 0; m < masks_per_row; ++m) {
        for (std::uint64_t left = masks[m]; left != 0; left &= left - 1)
            f(64 * m + static_cast<std::size_t>(std::countr_zero(left)));
    }
}

// Calls f(w) for each active word of a row, in ascending order.
template <class F>
HWY_INLINE void for_each_active_word(const ActiveWords& active, std::size_t row, const F& f) {
    for_each_marked_word(active.row(row), active.masks_per_row, f);
}

// Writes an element for each set bit of a word to `out`: put(left, element) gets the bits that are left, and
// writes the element of the lowest. Returns the end of the elements.
//
// The number of bits in a word is unpredictable, so a loop that ends after the last bit would mispredict
// nearly every time. But most words have at most four. So four elements are always written without a test,
// and the next word's elements overwrite those beyond the end. There must be room for three elements more
// than there are bits, and for four if there are none; for these put() gets left = 0.
template <class Element, class Put>
HWY_INLINE Element* list_bits(std::uint64_t bits, Element* HWY_RESTRICT out, const Put& put) {
    Element* const end = out + popcount(bits);
    do {
        for (std::size_t i = 0; i < 4; ++i) {
            put(bits, out[i]);
            bits &= bits - 1;
        }
        out += 4;
    } while (HWY_UNLIKELY(out < end));
    return end;
}

// Writes `first` plus the index of each set bit of a word to `out`, in ascending order. Returns the end of
// these numbers. Up to 16 elements after it are overwritten.
HWY_INLINE std::uint32_t* list_indices(std::uint64_t bits, std::uint32_t first,
                                       std::uint32_t* HWY_RESTRICT out) {
#if HWY_TARGET == HWY_AVX3_DL
    const hn::FixedTag<std::uint8_t, 64> d8;
    const hn::FixedTag<std::uint32_t, 16> d32;
    const auto set = hn::LoadMaskBits(d8, reinterpret_cast<const std::uint8_t*>(&bits));
    const auto indices = hn::Compress(hn::Iota(d8, 0), set);
    const std::size_t count = popcount(bits);
    const auto write = [&](auto some, std::size_t k) HWY_ATTR {
        hn::StoreU(hn::Add(hn::PromoteTo(d32, some), hn::Set(d32, first)), d32, out + k);
    };
    write(hn::LowerHalf(hn::LowerHalf(indices)), 0);
    if (HWY_UNLIKELY(count > 16)) {
        HWY_ALIGN std::uint8_t all[64];
        hn::Store(indices, d8, all);
        for (std::size_t k = 16; k < count; k += 16)
            write(hn::Load(hn::FixedTag<std::uint8_t, 16>(), all + k), k);
    }
    return out + count;
#else
    return list_bits(bits, out, [first](std::uint64_t left, std::uint32_t& index) HWY_ATTR {
        // The highest bit changes nothing unless no bit is left. Without it, compilers branch on that.
        index = first + static_cast<std::uint32_t>(std::countr_zero(left | std::uint64_t{1} << 63));
    });
#endif
}

// The eight corners of 64 cells: bit i of corners[v] is corner v of cell i.
struct CellBits {
    alignas(64) std::uint64_t corners[8];

    CellBits(const RowBits& row, std::size_t w) {
        for (int r = 0; r < 4; ++r) {
            corners[2 * r] = row.rows[r][w];
            corners[2 * r + 1] = row.next_x(static_cast<Row>(r), w);
        }
    }
};

// The corners of the cells of as many words as a vector has lanes, in the layout of CellBits.
struct CellVecs {
    WordVec corners[8];

    CellVecs(const RowBits& row, std::size_t w) {
        const Words d;
        for (int r = 0; r < 4; ++r) {
            const auto samples = hn::LoadU(d, row.rows[r] + w);
            const auto ahead = hn::LoadU(d, row.rows[r] + w + 1);
            corners[2 * r] = samples;
            corners[2 * r + 1] = hn::Or(hn::ShiftRight<1>(samples), hn::ShiftLeft<63>(ahead));
        }
    }

    WordVec active() const {
        const auto& c = corners;
        const auto some = hn::Or(hn::Or(hn::Or(c[0], c[1]), hn::Or(c[2], c[3])),
                                 hn::Or(hn::Or(c[4], c[5]), hn::Or(c[6], c[7])));
        const auto all = hn::And(hn::And(hn::And(c[0], c[1]), hn::And(c[2], c[3])),
                                 hn::And(hn::And(c[4], c[5]), hn::And(c[6], c[7])));
        return hn::AndNot(all, some);
    }
};

// The cells with an ambiguous face: all four of its edges are crossed.
HWY_INLINE WordVec have_ambiguous_faces(const CellVecs& cells) {
    const auto& c = cells.corners;
    const auto all = [](WordVec p, WordVec q, WordVec r) HWY_ATTR { return hn::And(hn::And(p, q), r); };
    const WordVec x[4] = {hn::Xor(c[0], c[1]), hn::Xor(c[2], c[3]), hn::Xor(c[4], c[5]), hn::Xor(c[6], c[7])};
    const auto y0 = hn::Xor(c[0], c[2]), y1 = hn::Xor(c[4], c[6]);
    const auto z0 = hn::Xor(c[0], c[4]), z1 = hn::Xor(c[2], c[6]);
    const auto faces_along_x = hn::Or(hn::Or(all(x[0], x[1], y0), all(x[2], x[3], y1)),
                                      hn::Or(all(x[0], x[2], z0), all(x[1], x[3], z1)));
    const auto faces_across_x =
        hn::Or(all(y0, y1, z0), all(hn::Xor(c[1], c[3]), hn::Xor(c[5], c[7]), hn::Xor(c[1], c[5])));
    return hn::Or(faces_along_x, faces_across_x);
}

// The cells with two antipodal corners that differ from the other six: of the edges along each axis, only
// those that end at one of the two are crossed.
HWY_INLINE WordVec have_antipodes(const CellVecs& cells) {
    const auto& c = cells.corners;
    const WordVec x[4] = {hn::Xor(c[0], c[1]), hn::Xor(c[2], c[3]), hn::Xor(c[4], c[5]), hn::Xor(c[6], c[7])};
    const auto on_0_and_3 = hn::AndNot(hn::Or(x[1], x[2]), hn::And(x[0], x[3]));
    const auto on_1_and_2 = hn::AndNot(hn::Or(x[0], x[3]), hn::And(x[1], x[2]));
    // For a corner at y = 0 and the one at y = 1: the edge along y between them, and their edges along z.
    const auto alone = [&](int near, int far) HWY_ATTR {
        const auto y = hn::Xor(c[near], c[far]);
        const auto z_near = hn::Xor(c[near], c[near + 4]), z_far = hn::Xor(c[far], c[far + 4]);
        const auto only_near = hn::AndNot(z_far, z_near), only_far = hn::AndNot(z_near, z_far);
        return hn::And(y, hn::Or(hn::And(on_0_and_3, only_near), hn::And(on_1_and_2, only_far)));
    };
    return hn::Or(alone(0, 2), alone(1, 3));
}

// The cells in which the samples may decide the topology. No others have more than one loop.
HWY_INLINE WordVec may_be_ambiguous(const CellVecs& cells) {
    return hn::Or(have_ambiguous_faces(cells), have_antipodes(cells));
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
