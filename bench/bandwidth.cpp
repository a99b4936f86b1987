// Reads and writes a large buffer with all threads.
#include "bandwidth.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <vector>

#include <marrow/buffer.h>

namespace marrow::bench {
namespace {

constexpr std::size_t kWords = std::size_t{1} << 25;  // 256 MiB
constexpr std::size_t kChunk = std::size_t{1} << 17;
constexpr std::size_t kAhead = 256;
constexpr int kRounds = 7;

template <class F>
double bytes_per_second(int threads, const F& chunk) {
    tbb::task_arena arena(threads);
    std::vector<double> seconds;
    for (int round = 0; round < kRounds; ++round) {
        const auto start = std::chrono::steady_clock::now();
        arena.execute([&] {
            tbb::parallel_for(std::size_t{0}, kWords / kChunk, [&](std::size_t c) { chunk(c * kChunk); });
        });
        seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    std::sort(seconds.begin(), seconds.end());
    return static_cast<double>(kWords * sizeof(std::uint64_t)) / seconds[kRounds / 2];
}

}  // namespace

Bandwidth measure_bandwidth(int threads) {
    Buffer<std::uint64_t> memory(kWords, 1);
    std::atomic<std::uint64_t> sum = 0;
    const double read = bytes_per_second(threads, [&](std::size_t begin) {
        std::uint64_t lanes[16] = {};  // independent sums, so that additions do not wait for each other
        for (std::size_t i = begin; i < begin + kChunk; i += 16) {
            // The prefetcher of the processor restarts on each page.
            for (std::size_t line = 0; line < 16; line += 8)
                __builtin_prefetch(memory.data() + i + line + kAhead);
            for (std::size_t k = 0; k < 16; ++k) lanes[k] += memory[i + k];
        }
        for (const std::uint64_t lane : lanes) sum += lane;
    });
    const double write = bytes_per_second(threads, [&](std::size_t begin) {
        std::memset(&memory[begin], static_cast<int>(sum & 1), kChunk * sizeof(std::uint64_t));
    });
    return {read, write};
}

}  // namespace marrow::bench
