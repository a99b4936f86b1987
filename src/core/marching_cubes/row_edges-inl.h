// Lists the crossed edges of a row. Each SIMD target includes this file once.
#if defined(MARROW_ROW_EDGES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MARROW_ROW_EDGES_INL_H
#undef MARROW_ROW_EDGES_INL_H
#else
#define MARROW_ROW_EDGES_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "inside_bits.h"
#include "row_bits-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

// A crossed edge of a row in 32 bits: its axis, and one more than the x of the sample at which it starts,
// which is -1 if it enters the volume.
struct EdgeCode {
    static constexpr unsigned kAxisShift = 30;
    static constexpr std::uint32_t kPlaceMask = (std::uint32_t{1} << kAxisShift) - 1;

    static std::uint32_t of(std::uint32_t axis, std::int64_t x) {
        return (axis << kAxisShift) + static_cast<std::uint32_t>(x + 1);
    }
    static std::size_t axis(std::uint32_t code) { return code >> kAxisShift; }
    static std::int64_t x(std::uint32_t code) { return static_cast<std::int64_t>(code & kPlaceMask) - 1; }
};

// The codes of the crossed edges of a row: of those along x, then y, then z, each in ascending order.
class RowEdges {
  public:
    // This many elements after the end of the list may be written, and read.
    static constexpr std::size_t kSlack = 16;

    explicit RowEdges(const InsideBits& bits)
        : first_x_(bits.first_x), codes_(3 * 64 * bits.words_per_row + kSlack) {
        std::fill(codes_.begin(), codes_.end(), 0);
    }

    // One axis after the other, so that what is written beyond the end of one is overwritten by the next.
    void list(const ActiveWords& active, const RowBits& row, std::size_t r) noexcept {
        std::uint32_t* end = codes_.data();
        const auto list_axis = [&](std::uint32_t axis, const auto& crossed) HWY_ATTR {
            for_each_active_word(active, r, [&](std::size_t w) HWY_ATTR {
                const std::int64_t x = 64 * static_cast<std::int64_t>(w) - first_x_;
                end = list_indices(crossed(w), EdgeCode::of(axis, x), end);
            });
        };
        list_axis(0, [&](std::size_t w) HWY_ATTR { return row.crossed_x(kRow, w); });
        list_axis(1, [&](std::size_t w) HWY_ATTR { return row.crossed_y(w); });
        list_axis(2, [&](std::size_t w) HWY_ATTR { return row.crossed_z(w); });
        count_ = static_cast<std::size_t>(end - codes_.data());
    }

    const std::uint32_t* codes() const { return codes_.data(); }
    std::size_t count() const { return count_; }

  private:
    const std::int64_t first_x_;
    Buffer<std::uint32_t> codes_;
    std::size_t count_ = 0;
};

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
