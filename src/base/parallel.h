/// Runs work on a chosen number of threads, with progress and cancellation.
///
/// All parallel work of the library goes through this header. oneTBB does it; where there is none, as in
/// browsers, it is a small pool of threads. Both have the same interface, described here:
///
/// - `thread_count()`: the threads that take part in the loops of the current with_threads().
/// - `parallel_for(begin, end, f)`: calls f(i) for each i in [begin, end).
/// - `parallel_for_ranges(begin, end, grain, f)`: calls f(range) for ranges that cover [begin, end), of
///   about `grain` or more numbers each.
/// - `parallel_reduce(begin, end, grain, identity, f, join)`: sums join(left, right) over f(range,
///   identity). How the numbers are divided depends only on their count and on `grain`, so the sum has the
///   same bits for any number of threads.
/// - `parallel_invoke(f, ...)`: calls all functions.
/// - `isolate(f)`: calls f. While it waits for loops of its own, this thread does not
///   take up work from outside of it.
/// - `PerThread<T>`: a T for each thread that asks for it by local(); a range of them.
/// - `ConcurrentMap<Key, Value, Hash>`: a hash map to which threads add at the same time, and which
///   keeps its elements in their places.
///
/// Calls return when all the work is done. The first exception is thrown again by the call, which then
/// skips work that did not start yet.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>

#ifdef __EMSCRIPTEN__
#include "parallel_pool.h"
#else
#include "parallel_tbb.h"
#endif
#include "progress.h"

namespace marrow::internal {

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
