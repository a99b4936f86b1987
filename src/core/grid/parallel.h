/// What every way through the passes shares: checks, threads, shares of the output, progress.
#pragma once

#include <cstddef>
#include <cstdint>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <marrow/histo_pyramid.h>
#include <marrow/volume.h>

#include "base/parallel.h"

namespace marrow::internal {

/// \throw InputError not finite
void check_isovalue(double isovalue);
/// \throw LimitError more points than triangles can name
void check_point_count(std::uint64_t points);
/// Whether a grid has any cell; without one there is no surface.
bool has_cells(const Geometry& geometry, bool closed);

/// Into how many shares work on the output is divided: several a thread, so that none waits long for the slowest.
inline constexpr std::size_t kSharesPerThread = 8;
std::size_t share_count();

/// The row at which the part of the output from `key` on starts: the first that does not begin before it.
std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key);

/// Runs f(begin, end) on up to share_count() parts of the rows [row_begin, row_end) that make equal shares of the output.
template <class F>
void for_each_share(const HistoPyramid& pyramid, std::size_t row_begin, std::size_t row_end, const F& f) {
    const std::uint64_t first = pyramid.first_output(row_begin),
                        total = pyramid.first_output(row_end) - first;
    if (total == 0) return;
    const std::size_t shares = share_count();
    tbb::parallel_for(std::size_t{0}, shares, [&](std::size_t share) {
        const std::size_t begin = row_at(pyramid, first + total * share / shares);
        const std::size_t end =
            share + 1 == shares ? row_end : row_at(pyramid, first + total * (share + 1) / shares);
        if (begin < end) f(begin, end);
    });
}

}  // namespace marrow::internal
