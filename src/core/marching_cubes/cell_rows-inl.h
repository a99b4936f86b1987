// Lists the cases of cells, 64 cells at a time. Each SIMD target includes this file once.
#if defined(MARROW_CELL_ROWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_CELL_ROWS_INL_H
#undef MARROW_CELL_ROWS_INL_H
#else
#define MARROW_CELL_ROWS_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

#if HWY_TARGET == HWY_AVX3_DL || HWY_TARGET == HWY_WASM

// The samples around the 64 cells of a word: bit i of here_[r] is the sample at x = i in row r of RowBits,
// and of next_[r] the sample at x = i + 1.
class CellRows {
  public:
    CellRows(const RowBits& row, std::size_t w) {
        for (std::size_t r = 0; r < 4; ++r) {
            here_[r] = row.rows[r][w];
            next_[r] = row.next_x(static_cast<Row>(r), w);
        }
    }

    // The cells that the surface crosses: their corners are neither all outside nor all inside.
    HWY_INLINE std::uint64_t active() const {
        const std::uint64_t some =
            here_[0] | here_[1] | here_[2] | here_[3] | next_[0] | next_[1] | next_[2] | next_[3];
        const std::uint64_t all =
            here_[0] & here_[1] & here_[2] & here_[3] & next_[0] & next_[1] & next_[2] & next_[3];
        return some & ~all;
    }

    // Writes the indices into kRunningCases of those of the cells that `active` selects. Returns their end;
    // 64 bytes more may be overwritten.
#if HWY_TARGET == HWY_AVX3_DL
    HWY_INLINE std::uint8_t* list(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
        auto cases = hn::Zero(D());
        for (std::size_t r = 0; r < 4; ++r) {
            cases = hn::Or(cases, hn::IfThenElseZero(cells(here_[r]), hn::Set(D(), 1 << r)));
            cases = hn::Or(cases, hn::IfThenElseZero(cells(next_[r]), hn::Set(D(), 16 << r)));
        }
        hn::StoreU(hn::Compress(cases, cells(active)), D(), out);
        return out + popcount(active);
    }
#else
    HWY_INLINE std::uint8_t* list(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
        // Byte r of groups[g] has the bits of corner r of eight cells, from cell 8 g on.
        alignas(16) std::uint64_t groups[8];
        transpose_bytes(groups);
        return list_bits(active, out, [&](std::uint64_t left, std::uint8_t& cell_case) HWY_ATTR {
            const auto cell = static_cast<unsigned>(std::countr_zero(left | std::uint64_t{1} << 63));
            // The product moves the lowest bit of byte r to bit 56 + r.
            const std::uint64_t corners = groups[cell / 8] >> cell % 8 & 0x0101010101010101;
            cell_case = static_cast<std::uint8_t>(corners * 0x0102040810204080 >> 56);
        });
    }
#endif

  private:
#if HWY_TARGET == HWY_WASM
    HWY_INLINE void transpose_bytes(std::uint64_t (&groups)[8]) const {
        // The bytes of words 2 k and 2 k + 1 in turn.
        const auto pair = [](const std::uint64_t* words) HWY_ATTR {
            return wasm_i8x16_shuffle(wasm_v128_load64_zero(words), wasm_v128_load64_zero(words + 1), 0, 16,
                                      1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
        };
        const auto lower = [](v128_t a, v128_t b)
                               HWY_ATTR { return wasm_i16x8_shuffle(a, b, 0, 8, 1, 9, 2, 10, 3, 11); };
        const auto upper = [](v128_t a, v128_t b)
                               HWY_ATTR { return wasm_i16x8_shuffle(a, b, 4, 12, 5, 13, 6, 14, 7, 15); };
        const v128_t here[2] = {pair(here_), pair(here_ + 2)}, next[2] = {pair(next_), pair(next_ + 2)};
        const v128_t first[2] = {lower(here[0], here[1]), lower(next[0], next[1])},
                     last[2] = {upper(here[0], here[1]), upper(next[0], next[1])};
        wasm_v128_store(groups, wasm_i32x4_shuffle(first[0], first[1], 0, 4, 1, 5));
        wasm_v128_store(groups + 2, wasm_i32x4_shuffle(first[0], first[1], 2, 6, 3, 7));
        wasm_v128_store(groups + 4, wasm_i32x4_shuffle(last[0], last[1], 0, 4, 1, 5));
        wasm_v128_store(groups + 6, wasm_i32x4_shuffle(last[0], last[1], 2, 6, 3, 7));
    }
#else
    using D = hn::FixedTag<std::uint8_t, 64>;

    static HWY_INLINE hn::Mask<D> cells(const std::uint64_t& bits) {
        return hn::LoadMaskBits(D(), reinterpret_cast<const std::uint8_t*>(&bits));
    }
#endif

    std::uint64_t here_[4], next_[4];
};

#else

#if HWY_CAP_GE256

// The indices of the bits that are set in each byte, in ascending order.
struct SetBits {
    alignas(64) std::uint8_t of[256][8] = {};

    constexpr SetBits() {
        for (unsigned byte = 0; byte < 256; ++byte) {
            std::uint8_t* next = of[byte];
            for (std::uint8_t bit = 0; bit < 8; ++bit)
                if ((byte >> bit & 1) != 0) *next++ = bit;
        }
    }
};
constexpr SetBits kSetBits;

#endif

// The samples around the 64 cells of a word. Lane r belongs to row r of RowBits: bit i of that lane of here_
// is the sample at x = i, and of next_ the sample at x = i + 1. Narrow targets have two rows in each of two
// vectors, or one in each of four.
class CellRows {
  public:
    CellRows(const RowBits& row, std::size_t w) {
        const bool last = w + 1 == row.words;
        for (std::size_t k = 0; k < kVectors; ++k) {
            here_[k] = samples(row, k, w);
            const Vec ahead = last ? hn::Zero(D()) : samples(row, k, w + 1);
            next_[k] = hn::Or(hn::ShiftRight<1>(here_[k]), hn::ShiftLeft<63>(ahead));
        }
    }

    // The cells that the surface crosses: their corners are neither all outside nor all inside.
    HWY_INLINE std::uint64_t active() const {
        Vec some = hn::Or(here_[0], next_[0]), all = hn::And(here_[0], next_[0]);
        for (std::size_t k = 1; k < kVectors; ++k) {
            some = hn::Or(some, hn::Or(here_[k], next_[k]));
            all = hn::And(all, hn::And(here_[k], next_[k]));
        }
        if constexpr (kLanes >= 2) {
            some = hn::Or(some, hn::Reverse2(D(), some));
            all = hn::And(all, hn::Reverse2(D(), all));
        }
#if HWY_CAP_GE256
        some = hn::Or(some, hn::SwapAdjacentBlocks(some));
        all = hn::And(all, hn::SwapAdjacentBlocks(all));
#endif
        return hn::GetLane(hn::AndNot(all, some));
    }
    // Writes the indices into kRunningCases of those of the cells that `active` selects. Returns their end;
    // eight bytes more may be overwritten.
    HWY_INLINE std::uint8_t* list(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
#if HWY_CAP_GE256
        // How many of more than four cells there are is unpredictable, so a loop over them would often be
        // mispredicted. The cases of all 64 take as long as those of some eight.
        if (popcount(active) > 4) return list_many(active, out);
#endif
        return list_bits(active, out, [&](std::uint64_t left, std::uint8_t& cell_case) HWY_ATTR {
            cell_case = running_case(left & (~left + 1));
        });
    }

  private:
    using D = hn::CappedTag<std::uint64_t, 4>;
    using Vec = hn::Vec<D>;
    static constexpr std::size_t kLanes = hn::MaxLanes(D()), kVectors = 4 / kLanes;

#if HWY_CAP_GE256
    // The same as list(), without a branch: eight cells at a time.
    HWY_INLINE std::uint8_t* list_many(std::uint64_t active, std::uint8_t* HWY_RESTRICT out) const {
        const hn::FixedTag<std::uint8_t, 8> d;
        alignas(32) std::uint8_t cases[64];
        find_cases(cases);
        for (std::size_t group = 0; group < 8; ++group) {
            const std::uint64_t some = active >> 8 * group & 0xff;
            const auto of_group = hn::Load(d, cases + 8 * group);
            hn::StoreU(hn::TableLookupBytes(of_group, hn::Load(d, kSetBits.of[some])), d, out);
            out += popcount(some);
        }
        return out;
    }

    // The cases of all 64 cells.
    HWY_INLINE void find_cases(std::uint8_t* HWY_RESTRICT cases) const {
        const hn::Repartition<std::uint8_t, D> d8;
        const hn::Repartition<std::uint16_t, D> d16;
        const hn::Repartition<std::uint32_t, D> d32;
        alignas(32) static constexpr std::uint8_t kInTurn[32] = {
            0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15,  //
            0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15};
        alignas(32) static constexpr std::int32_t kHereAndNext[8] = {0, 4, 1, 5, 2, 6, 3, 7};
        // The bytes of two rows in turn, then those of four rows, then those at x and at x + 1: for each
        // group of eight cells one byte with each of their corners.
        const auto in_turn = hn::Load(d8, kInTurn);
        const auto here = hn::TableLookupBytes(hn::BitCast(d8, here_[0]), in_turn);
        const auto next = hn::TableLookupBytes(hn::BitCast(d8, next_[0]), in_turn);
        const auto rows_0_1 = hn::BitCast(d16, hn::ConcatLowerLower(d8, next, here));
        const auto rows_2_3 = hn::BitCast(d16, hn::ConcatUpperUpper(d8, next, here));
        const auto here_and_next = hn::SetTableIndices(d32, kHereAndNext);
        const auto write = [&](auto rows, std::uint8_t* to) HWY_ATTR {
            const auto groups = hn::TableLookupLanes(hn::BitCast(d32, rows), here_and_next);
            hn::Store(hn::BitCast(d8, transposed(hn::BitCast(D(), groups))), d8, to);
        };
        write(hn::InterleaveLower(d16, rows_0_1, rows_2_3), cases);
        write(hn::InterleaveUpper(d16, rows_0_1, rows_2_3), cases + 32);
    }

    // In each lane, bit k of byte r becomes bit r of byte k.
    static HWY_INLINE Vec transposed(Vec bits) {
        bits = swap_bits<7>(bits, 0x00aa00aa00aa00aa);
        bits = swap_bits<14>(bits, 0x0000cccc0000cccc);
        return swap_bits<28>(bits, 0x00000000f0f0f0f0);
    }
    // Swaps the bits in `which` with those that are kDistance higher.
    template <int kDistance>
    static HWY_INLINE Vec swap_bits(Vec bits, std::uint64_t which) {
        const auto differ = hn::And(hn::Xor(bits, hn::ShiftRight<kDistance>(bits)), hn::Set(D(), which));
        return hn::Xor(bits, hn::Xor(differ, hn::ShiftLeft<kDistance>(differ)));
    }
#endif

    // The index into kRunningCases of the cell whose bit is set in `bit`.
    HWY_INLINE std::uint8_t running_case(std::uint64_t bit) const {
        const Vec cell = hn::Set(D(), bit);
        unsigned c = 0;
        for (std::size_t k = 0; k < kVectors; ++k) {
            std::uint8_t here[8] = {}, next[8] = {};  // as many bytes as StoreMaskBits may write
            hn::StoreMaskBits(D(), hn::TestBit(here_[k], cell), here);
            hn::StoreMaskBits(D(), hn::TestBit(next_[k], cell), next);
            c |= static_cast<unsigned>(here[0] | next[0] << 4) << kLanes * k;
        }
        return static_cast<std::uint8_t>(c);
    }

    // Word w of each row of vector k.
    static HWY_INLINE Vec samples(const RowBits& row, std::size_t k, std::size_t w) {
        const D d;
        const auto of_row = [&](std::size_t r) HWY_ATTR { return hn::Set(d, row.rows[kLanes * k + r][w]); };
#if HWY_CAP_GE256
        return hn::ConcatUpperLower(d, hn::OddEven(of_row(3), of_row(2)), hn::OddEven(of_row(1), of_row(0)));
#else
        if constexpr (kLanes == 2) return hn::OddEven(of_row(1), of_row(0));
        return of_row(0);
#endif
    }

    Vec here_[kVectors], next_[kVectors];
};

#endif

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
