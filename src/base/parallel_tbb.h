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

#include <algorithm>
#include <cstddef>

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

template <class Index, class F>
void parallel_for(Index begin, Index end, const F& f) {
    tbb::parallel_for(begin, end, f);
}

template <class Index, class F>
void parallel_for_ranges(Index begin, Index end, std::size_t grain, const F& f) {
    tbb::parallel_for(tbb::blocked_range<Index>(begin, end, grain), f);
}

template <class Index, class T, class F, class Join>
T parallel_reduce(Index begin, Index end, std::size_t grain, const T& identity, const F& f,
                  const Join& join) {
    return tbb::parallel_deterministic_reduce(tbb::blocked_range<Index>(begin, end, grain), identity, f,
                                              join);
}

template <class... F>
void parallel_invoke(const F&... f) {
    tbb::parallel_invoke(f...);
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
