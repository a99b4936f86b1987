// Compares samples with those before and after them, in plain loops that the compiler makes vectors
// of, once for each SIMD target.
#include "peaks.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/trust/peaks.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "core/volume/rows.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

constexpr std::int64_t kBlock = 64;

// By value, unlike std::min and std::max, so that loops of them become vectors. A NaN
// counts only if it comes first.
template <class T>
HWY_INLINE T lower(T a, T b) {
    return b < a ? b : a;
}
template <class T>
HWY_INLINE T higher(T a, T b) {
    return a < b ? b : a;
}

// Holds differences of samples exactly.
template <class T>
using Real = std::conditional_t<std::is_integral_v<T> && sizeof(T) <= 2, float, double>;

// The limits, a little wider than they are, so that rounding never excludes a sample.
template <class T>
struct RoundedLimits {
    Real<T> isovalue, contrast, least_part, most_part, slack;

    explicit RoundedLimits(const WallLimits& limits)
        : isovalue(static_cast<Real<T>>(limits.isovalue)),
          contrast(static_cast<Real<T>>(limits.least_contrast * (1 - kRounding))),
          least_part(static_cast<Real<T>>(limits.least_part * (1 - kRounding))),
          most_part(static_cast<Real<T>>(limits.most_part * (1 + kRounding))),
          slack(static_cast<Real<T>>(kRounding * std::abs(limits.isovalue))) {}

  private:
    static constexpr double kRounding = 1e-6;
};

// The samples before and after those of a block along an axis, the nearest ones first.
template <class T>
struct Sides {
    const T* before[kReach];
    const T* after[kReach];
};

template <class T>
HWY_INLINE void add_peaks(const T* samples, const Sides<T>& sides, const RoundedLimits<T>& limits,
                          std::int64_t count, std::uint8_t* peaks) {
    const auto& [before, after] = sides;
    for (std::int64_t i = 0; i < count; ++i) {
        const T value = samples[i];
        const T low_before = lower(lower(before[0][i], before[1][i]), before[2][i]);
        const T low_after = lower(lower(after[0][i], after[1][i]), after[2][i]);
        const auto base = static_cast<Real<T>>(higher(low_before, low_after));
        const Real<T> contrast = static_cast<Real<T>>(value) - base, needed = limits.isovalue - base;
        // No short circuits: they would be branches.
        const bool is_peak = (before[0][i] <= value) & (after[0][i] < value) & (contrast >= limits.contrast) &
                             (contrast >= limits.least_part * needed - limits.slack) &
                             (contrast < limits.most_part * needed + limits.slack);
        peaks[i] |= is_peak ? 1 : 0;
    }
}

// Bit i of the result is element i, which is 0 or 1.
HWY_INLINE std::uint64_t bits_of(const std::uint8_t (&elements)[kBlock]) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < kBlock; i += 8) {
        std::uint64_t eight = 0;
        std::memcpy(&eight, elements + i, sizeof eight);
        bits |= (eight * 0x0102040810204080) >> 56 << i;  // the first element is in the lowest byte
    }
    return bits;
}

template <class T>
class PeakRow {
  public:
    PeakRow(const VolumeView& volume, const WallLimits& limits, std::int64_t y, std::int64_t z)
        : row_(row_of<T>(volume, y, z)), size_(volume.geometry.dims[0]), limits_(limits) {
        const auto [nx, ny, nz] = volume.geometry.dims;
        for (std::int64_t step = 1; step <= kReach; ++step) {
            const auto i = static_cast<std::size_t>(step - 1);
            // Beyond the border the last sample stands in: the lowest one stays the same.
            along_y_.before[i] = row_of<T>(volume, std::max<std::int64_t>(y - step, 0), z);
            along_y_.after[i] = row_of<T>(volume, std::min(y + step, ny - 1), z);
            along_z_.before[i] = row_of<T>(volume, y, std::max<std::int64_t>(z - step, 0));
            along_z_.after[i] = row_of<T>(volume, y, std::min(z + step, nz - 1));
            const std::int64_t next_y = std::min(y + 1, ny - 1);
            next_rows_[2 * i] = row_of<T>(volume, next_y, std::max<std::int64_t>(z - step, 0));
            next_rows_[2 * i + 1] = row_of<T>(volume, next_y, std::min(z + step, nz - 1));
        }
    }

    // The peaks of the block that begins at x.
    std::uint64_t find(std::int64_t x) const {
        if (x >= kReach && x + kBlock + kReach <= size_) return find(row_ + x, x, kBlock);
        T line[kBlock + 2 * kReach];  // the samples of the block and those within reach
        for (std::int64_t i = 0; i < kBlock + 2 * kReach; ++i)
            line[i] = row_[std::clamp<std::int64_t>(x + i - kReach, 0, size_ - 1)];
        return find(line + kReach, x, std::min(kBlock, size_ - x));
    }

    // Asks for the samples of the next row, which are seldom in the cache yet: most rows have their peaks
    // beside those of the row before.
    HWY_INLINE void prefetch_next_row(std::int64_t x) const {
        for (const T* row : next_rows_) {
            for (std::int64_t i = 0; i < kBlock; i += kLine) hwy::Prefetch(row + x + i);
        }
    }

  private:
    static constexpr std::int64_t kLine = 64 / sizeof(T);  // samples in a cache line

    HWY_INLINE std::uint64_t find(const T* block, std::int64_t x, std::int64_t count) const {
        const Sides<T> along_x{{block - 1, block - 2, block - 3}, {block + 1, block + 2, block + 3}};
        std::uint8_t peaks[kBlock] = {};
        add_peaks(block, along_x, limits_, count, peaks);
        add_peaks(block, at(along_y_, x), limits_, count, peaks);
        add_peaks(block, at(along_z_, x), limits_, count, peaks);
        return bits_of(peaks);
    }
    static Sides<T> at(Sides<T> sides, std::int64_t x) {
        for (auto& row : sides.before) row += x;
        for (auto& row : sides.after) row += x;
        return sides;
    }

    const T* const row_;
    const std::int64_t size_;
    const RoundedLimits<T> limits_;
    Sides<T> along_y_{}, along_z_{};
    std::array<const T*, 2 * kReach> next_rows_{};
};

void keep_peaks_any(const VolumeView& volume, const WallLimits& limits, std::int64_t y, std::int64_t z,
                    std::uint64_t* words) {
    visit_sample_type(volume.type, [&](auto sample) HWY_ATTR {
        const PeakRow<decltype(sample)> row(volume, limits, y, z);
        for (std::int64_t x = 0; x < volume.geometry.dims[0]; x += kBlock) {
            std::uint64_t& word = words[x / kBlock];
            if (word == 0) continue;
            row.prefetch_next_row(x);
            word &= row.find(x);
        }
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(keep_peaks_any);

void keep_peaks(const VolumeView& volume, const WallLimits& limits, std::int64_t y, std::int64_t z,
                std::uint64_t* words) {
    HWY_DYNAMIC_DISPATCH(keep_peaks_any)(volume, limits, y, z, words);
}

}  // namespace marrow::internal
#endif  // HWY_ONCE
