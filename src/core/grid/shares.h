/// Divides the output of a pass into shares of about equal size, for threads to work on.
#pragma once

#include <cstddef>
#include <cstdint>

#include <marrow/histo_pyramid.h>

#include "base/parallel.h"

namespace marrow::internal {

/// With several shares per thread, no thread waits long for the slowest one.
inline constexpr std::size_t kSharesPerThread = 8;

/// The number of shares: kSharesPerThread for each thread of the current arena.
std::size_t share_count();

/// The first row that does not begin before output `key`. \pre the leaves of `pyramid` are rows
std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key);

/// Divides the rows [row_begin, row_end) into up to share_count() ranges with about equal output, and calls
/// f(begin, end) for each of them on the threads of the current arena.
template <class F>
void for_each_share(const HistoPyramid& pyramid, std::size_t row_begin, std::size_t row_end, const F& f) {
    const std::uint64_t first = pyramid.first_output(row_begin),
                        total = pyramid.first_output(row_end) - first;
    if (total == 0) return;
    const std::size_t shares = share_count();
    parallel_for(std::size_t{0}, shares, [&](std::size_t share) {
        const std::size_t begin = row_at(pyramid, first + total * share / shares);
        const std::size_t end =
            share + 1 == shares ? row_end : row_at(pyramid, first + total * (share + 1) / shares);
        if (begin < end) f(begin, end);
    });
}

}  // namespace marrow::internal
