/// Parallel loops.
#pragma once

#include <cstdint>

#include <tbb/parallel_for.h>

namespace marrow::internal {

/// The order that a parallel loop promises, in words that ThreadSanitizer understands: iterations come after what was before
/// the loop and before what is after it. oneTBB keeps it, but its library is not built for ThreadSanitizer, which would
/// take every loop for a race. Between iterations nothing is promised, so real races are still found.
class LoopOrder {
  public:
#if defined(__SANITIZE_THREAD__)
    void release();
    void acquire();
#else
    void release() {}
    void acquire() {}
#endif
};

/// Calls f(i) for begin <= i < end, from all threads of the arena.
template <class F>
void parallel_for(std::int64_t begin, std::int64_t end, const F& f) {
    [[maybe_unused]] LoopOrder order;
    order.release();
    tbb::parallel_for(begin, end, [&](std::int64_t i) {
        order.acquire();
        f(i);
        order.release();
    });
    order.acquire();
}

}  // namespace marrow::internal
