/// What the benchmarks time with.
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

/// Of all threads; on a machine that others use too, it says more than time on the wall.
inline double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

inline double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

/// One of a few ways to the same surfaces.
struct Way {
    const char* name;
    std::function<std::size_t()> work;  ///< returns how many triangles it made
};

/// Goes every way once a round, so that whatever slows the machine for a while slows them all, and prints medians and their
/// ratios to the first's: on the wall, and of processors.
inline void compare(std::span<const Way> ways, int rounds) {
    struct Times {
        std::vector<double> wall, processor;
    };
    std::vector<Times> times(ways.size());
    std::vector<std::size_t> triangles(ways.size());
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t w = 0; w < ways.size(); ++w) {
            const double begin = processor_seconds();
            const auto start = std::chrono::steady_clock::now();
            triangles[w] = ways[w].work();
            times[w].wall.push_back(milliseconds_since(start) / 1000);
            times[w].processor.push_back(processor_seconds() - begin);
        }
    }
    for (std::size_t w = 0; w < ways.size(); ++w) {
        const double wall = median(times[w].wall), processor = median(times[w].processor);
        fmt::print("{:<46} {:8.3f} s {:8.3f} s of processors  ratio {:5.1f} {:5.1f}  {} triangles\n",
                   ways[w].name, wall, processor, wall / median(times[0].wall),
                   processor / median(times[0].processor), triangles[w]);
    }
}

}  // namespace marrow::bench
