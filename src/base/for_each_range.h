/// Runs a loop in ranges of fixed size on all threads, with progress and cancellation.
#pragma once

#include <algorithm>
#include <cstddef>

#include "parallel.h"

namespace marrow::internal {

/// Calls f(first, last) for the ranges [first, last) of `size` numbers that cover [0, count), and reports
/// progress from `begin` to `end`. The ranges do not depend on the number of threads. \throw Cancelled
template <class F>
void for_each_range(std::size_t count, std::size_t size, const Progress& progress, double begin, double end,
                    const F& f) {
    const std::size_t ranges = (count + size - 1) / size;
    Stage stage(progress, begin, end, ranges);
    parallel_for(std::size_t{0}, ranges, [&](std::size_t i) {
        f(i * size, std::min((i + 1) * size, count));
        stage.step();
    });
}

}  // namespace marrow::internal
