// Slices worked on side by side.
#pragma once

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <mutex>

#include <marrow/progress.h>

namespace marrow {

/// Calls work(i) for i from 0 to count - 1 on `threads` threads (0: all), and reports progress from `begin`
/// to `end`. \throw what work throws, or Cancelled.
template <class Work>
void for_each_slice(std::size_t count, int threads, const Progress& progress, double begin, double end,
                    Work&& work) {
    std::mutex mutex;
    std::size_t done = 0;
    report(progress, begin);
    const int most = oneapi::tbb::info::default_concurrency();  // oneTBB warns on stderr when asked for more
    oneapi::tbb::task_arena arena(threads > 0 ? std::min(threads, most) : most);
    arena.execute([&] {
        oneapi::tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
            work(i);
            const std::lock_guard lock(mutex);
            ++done;
            report(progress, begin + (end - begin) * static_cast<double>(done) / static_cast<double>(count));
        });
    });
}

}  // namespace marrow
