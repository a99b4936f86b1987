/// Timing a few ways to the same result beside each other.
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

struct Arm {
    const char* name;
    std::function<std::size_t()> work;  ///< returns how many triangles it made
};

struct Seconds {
    double wall, processor;
};

inline double processor_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double median(std::vector<Seconds>& times, double Seconds::*part) {
    std::sort(times.begin(), times.end(),
              [&](const Seconds& a, const Seconds& b) { return a.*part < b.*part; });
    return times[times.size() / 2].*part;
}

/// Runs every arm once a round, so that whatever slows the machine for a while slows them all, and prints medians and their
/// ratios to the first arm's: on the wall, and of processors, which a busy machine disturbs less.
inline void measure(std::span<const Arm> arms, int rounds) {
    std::vector<std::vector<Seconds>> times(arms.size());
    std::vector<std::size_t> triangles(arms.size());
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t a = 0; a < arms.size(); ++a) {
            const double begin = processor_seconds();
            const auto start = std::chrono::steady_clock::now();
            triangles[a] = arms[a].work();
            const double wall =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            times[a].push_back({wall, processor_seconds() - begin});
        }
    }
    const Seconds first{median(times[0], &Seconds::wall), median(times[0], &Seconds::processor)};
    for (std::size_t a = 0; a < arms.size(); ++a) {
        const double wall = median(times[a], &Seconds::wall),
                     processor = median(times[a], &Seconds::processor);
        fmt::print("{:<46} {:8.3f} s {:8.3f} s of processors  ratio {:5.1f} {:5.1f}  {} triangles\n",
                   arms[a].name, wall, processor, wall / first.wall, processor / first.processor,
                   triangles[a]);
    }
}

}  // namespace marrow::bench
