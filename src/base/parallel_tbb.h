/// Parallel work by oneTBB; parallel.h describes the interface.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/concurrent_unordered_map.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cstddef>

#include <marrow/error.h>

namespace marrow::internal {

/// Runs f on `threads` threads; 0 means all of them.
template <class F>
void with_threads(int threads, const F& f) {
    // oneTBB prints a warning if an arena has more threads than the machine.
    const auto most =
        static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    tbb::task_arena(threads > 0 ? std::min(threads, most) : most).execute(f);
}

inline int thread_count() {
    return tbb::this_task_arena::max_concurrency();
}

/// If work around a loop has failed, oneTBB ends the loop early, in silence. What comes after the loop must
/// not take it for done. The call that failed ignores this exception.
inline void throw_if_abandoned() {
    if (tbb::is_current_task_group_canceling()) throw Cancelled();
}

template <class Index, class F>
void parallel_for(Index begin, Index end, const F& f) {
    tbb::parallel_for(begin, end, f);
    throw_if_abandoned();
}

template <class Index, class F>
void parallel_for_ranges(Index begin, Index end, std::size_t grain, const F& f) {
    tbb::parallel_for(tbb::blocked_range<Index>(begin, end, grain), f);
    throw_if_abandoned();
}

template <class Index, class T, class F, class Join>
T parallel_reduce(Index begin, Index end, std::size_t grain, const T& identity, const F& f,
                  const Join& join) {
    T sum =
        tbb::parallel_deterministic_reduce(tbb::blocked_range<Index>(begin, end, grain), identity, f, join);
    throw_if_abandoned();
    return sum;
}

template <class... F>
void parallel_invoke(const F&... f) {
    tbb::parallel_invoke(f...);
    throw_if_abandoned();
}

template <class F>
void isolate(const F& f) {
    tbb::this_task_arena::isolate(f);
}

template <class T>
using PerThread = tbb::enumerable_thread_specific<T>;

template <class Key, class Value, class Hash>
using ConcurrentMap = tbb::concurrent_unordered_map<Key, Value, Hash>;

}  // namespace marrow::internal
