/// Timers of the benchmarks, and interleaved comparisons.
#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <fmt/core.h>

namespace marrow::bench {

inline double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// The processor time of all threads so far. On a busy machine, it is more reliable than wall time.
inline double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// \pre there are values
inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// One of several methods to make the same surfaces.
struct Method {
    const char* name;
    std::function<std::size_t()> work;  ///< returns the number of triangles
};

/// Runs every method once per round, so that a temporary slowdown of the machine affects them all. Prints the
/// medians of wall and processor time, and their ratios to those of the first method.
inline void compare(std::span<const Method> methods, int rounds) {
    struct Times {
        std::vector<double> wall, processor;
    };
    std::vector<Times> times(methods.size());
    std::vector<std::size_t> triangles(methods.size());
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t w = 0; w < methods.size(); ++w) {
            const double begin = processor_seconds();
            const auto start = std::chrono::steady_clock::now();
            triangles[w] = methods[w].work();
            times[w].wall.push_back(milliseconds_since(start) / 1000);
            times[w].processor.push_back(processor_seconds() - begin);
        }
    }
    for (std::size_t w = 0; w < methods.size(); ++w) {
        const double wall = median(times[w].wall), processor = median(times[w].processor);
        fmt::print("{:<46} {:8.3f} s wall {:8.3f} s processor  ratio {:5.1f} {:5.1f}  {} triangles\n",
                   methods[w].name, wall, processor, wall / median(times[0].wall),
                   processor / median(times[0].processor), triangles[w]);
    }
}

}  // namespace marrow::bench
