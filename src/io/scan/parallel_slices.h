/// Processes slices in parallel, with progress.
#pragma once

#include <cstddef>
#include <functional>

#include "base/parallel.h"
#include "base/progress.h"

namespace marrow::internal::io {

/// Called when a part of the work on a slice is done. The parts of a slice add up to 1. \throw Cancelled
using Step = std::function<void(double part)>;

/// Calls work(i, step) for i from 0 to count - 1 on `threads` threads; 0 means all. The work calls `step`
/// until its parts add up to 1. Reports progress from `begin` to `end`. \throw what the work throws;
/// Cancelled
template <class Work>
void for_each_slice(std::size_t count, int threads, const Progress& progress, double begin, double end,
                    Work&& work) {
    report_progress(progress, begin);
    Stage stage(progress, begin, end, count);
    const Step step = [&](double part) { stage.step(part); };
    with_threads(threads,
                 [&] { parallel_for(std::size_t{0}, count, [&](std::size_t i) { work(i, step); }); });
}

/// Calls work(i) for i from 0 to count - 1, on the threads of the surrounding for_each_slice.
template <class Work>
void for_each_part(std::size_t count, Work&& work) {
    // Isolated: a waiting thread must not start another slice, which would use the same workspace.
    isolate([&] { parallel_for(std::size_t{0}, count, [&](std::size_t i) { work(i); }); });
}

}  // namespace marrow::internal::io
