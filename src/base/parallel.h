/// Runs work on a chosen number of threads, with progress and cancellation.
#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>

#include "progress.h"

namespace marrow::internal {

/// Runs f on `threads` threads; 0 means all of them.
template <class F>
void with_threads(int threads, const F& f) {
    // oneTBB prints a warning if an arena has more threads than the machine.
    const auto most =
        static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    tbb::task_arena(threads > 0 ? std::min(threads, most) : most).execute(f);
}

/// Counts the equal steps of a stage of work and reports progress from `begin` to `end`. Any thread may call
/// step().
class Stage {
  public:
    /// Refers to `progress`, which must outlive it.
    Stage(const Progress& progress, double begin, double end, std::size_t steps)
        : progress_(progress), begin_(begin), end_(end), steps_(static_cast<double>(steps)) {}

    /// Counts a step, or a part of one. \throw Cancelled
    void step(double part = 1) {
        if (!progress_) return;
        const std::lock_guard lock(mutex_);
        done_ += part;
        // Parts such as 1/3 do not add up exactly.
        const bool complete = done_ > steps_ - 1e-6;
        report_progress(progress_, complete ? end_ : std::lerp(begin_, end_, done_ / steps_));
    }

  private:
    const Progress& progress_;
    const double begin_, end_, steps_;
    double done_ = 0;
    std::mutex mutex_;
};

}  // namespace marrow::internal
