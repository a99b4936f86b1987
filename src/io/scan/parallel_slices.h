// Slices worked on side by side.
#pragma once

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <mutex>

#include "base/progress.h"

namespace marrow {

/// Called when a part of the work on a slice is done; the parts of a slice add up to 1. \throw Cancelled.
using Step = std::function<void(double part)>;

/// Calls work(i, step) for i from 0 to count - 1 on `threads` threads (0: all), which calls step(1), be it in parts. Reports
/// progress from `begin` to `end`. \throw what work throws, or Cancelled.
template <class Work>
void for_each_slice(std::size_t count, int threads, const Progress& progress, double begin, double end,
                    Work&& work) {
    std::mutex mutex;
    double done = 0, reached = begin;
    internal::report_progress(progress, begin);
    const Step step = [&](double part) {
        const std::lock_guard lock(mutex);
        done += part;
        const auto all = static_cast<double>(count);
        // sums of parts are not exact
        reached = done > all - 1e-6 ? end : std::max(reached, begin + (end - begin) * done / all);
        internal::report_progress(progress, reached);
    };
    const int most = oneapi::tbb::info::default_concurrency();  // oneTBB warns on stderr when asked for more
    oneapi::tbb::task_arena arena(threads > 0 ? std::min(threads, most) : most);
    arena.execute(
        [&] { oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { work(i, step); }); });
}

/// Calls work(i) for i from 0 to count - 1 within the work of for_each_slice, on its threads. \throw what work throws.
template <class Work>
void for_each_part(std::size_t count, Work&& work) {
    // isolated: a thread that waits here must not begin another slice, whose memory would be that of this one
    oneapi::tbb::this_task_arena::isolate(
        [&] { oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { work(i); }); });
}

}  // namespace marrow
