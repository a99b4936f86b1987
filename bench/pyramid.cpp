// marrow-bench-pyramid: times building and descending histogram pyramids, compared with flat offsets.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <random>
#include <vector>

#include <marrow/histo_pyramid.h>

namespace marrow::bench {
namespace {

constexpr int kRounds = 7;
constexpr std::size_t kKeys = 200'000;

// The median over a few rounds, in nanoseconds.
template <class Work>
double nanoseconds(const Work& work) {
    std::vector<double> times;
    for (int round = 0; round < kRounds; ++round) {
        const auto start = std::chrono::steady_clock::now();
        work();
        times.push_back(
            std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
    }
    std::nth_element(times.begin(), times.begin() + kRounds / 2, times.end());
    return times[kRounds / 2];
}

// N leaves, of which M have 1 to 5 outputs and the others none.
std::vector<std::uint32_t> make_leaves(std::size_t n, std::size_t m, std::mt19937& random) {
    std::vector<std::uint32_t> leaves(n, 0);
    for (std::size_t i = 0; i < m; ++i) leaves[i] = 1 + static_cast<std::uint32_t>(random() % 5);
    std::shuffle(leaves.begin(), leaves.end(), random);
    return leaves;
}

struct Cost {
    double build, descent, descent_in_order;  // ns per leaf, per key, per key
};

// The sum of all results, so that the compiler cannot omit the search.
std::size_t sink = 0;

template <class Locate>
double time_keys(const std::vector<std::uint64_t>& keys, const Locate& locate) {
    return nanoseconds([&] {
               for (const std::uint64_t key : keys) sink += locate(key);
           }) /
           static_cast<double>(keys.size());
}

Cost measure_pyramid(const std::vector<std::uint32_t>& leaves, std::size_t branching,
                     const std::vector<std::uint64_t>& shuffled, const std::vector<std::uint64_t>& sorted) {
    HistoPyramid pyramid;
    std::vector<std::uint32_t> taken = leaves;
    const double build = nanoseconds([&] {
        pyramid = HistoPyramid(std::move(taken), branching);
        taken = pyramid.release_leaves();
    });
    pyramid = HistoPyramid(std::move(taken), branching);
    const auto locate = [&](std::uint64_t key) { return pyramid.locate(key).leaf; };
    return {build / static_cast<double>(leaves.size()), time_keys(shuffled, locate),
            time_keys(sorted, locate)};
}

// Flat offsets: the prefix sums of the outputs of all leaves, and binary search.
Cost measure_offsets(const std::vector<std::uint32_t>& leaves, const std::vector<std::uint64_t>& shuffled,
                     const std::vector<std::uint64_t>& sorted) {
    std::vector<std::uint64_t> ends(leaves.size());
    const double build = nanoseconds([&] {
        std::vector<std::uint64_t>(leaves.size()).swap(ends);
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < leaves.size(); ++i) ends[i] = sum += leaves[i];
    });
    const auto locate = [&](std::uint64_t key) {
        return static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), key) - ends.begin());
    };
    return {build / static_cast<double>(leaves.size()), time_keys(shuffled, locate),
            time_keys(sorted, locate)};
}

void run() {
    fmt::print(
        "| leaves N | active M | index | build, ns/leaf | descent, ns/key | sorted keys, ns/key | bytes/leaf "
        "|\n"
        "| ---: | ---: | --- | ---: | ---: | ---: | ---: |\n");
    std::mt19937 random(1);
    for (const std::size_t n :
         {std::size_t{1} << 12, std::size_t{1} << 16, std::size_t{1} << 20, std::size_t{1} << 24}) {
        for (const std::size_t m : {n / 100, n / 5, n}) {
            const std::vector<std::uint32_t> leaves = make_leaves(n, m, random);
            const std::uint64_t total = std::accumulate(leaves.begin(), leaves.end(), std::uint64_t{0});
            std::vector<std::uint64_t> keys(kKeys);
            for (std::uint64_t& key : keys) key = random() % total;
            std::vector<std::uint64_t> sorted = keys;
            std::sort(sorted.begin(), sorted.end());
            const auto line = [&](const std::string& index, const Cost& cost, double bytes) {
                fmt::print("| {} | {} | {} | {:.2f} | {:.0f} | {:.0f} | {:.2f} |\n", n, m, index, cost.build,
                           cost.descent, cost.descent_in_order, bytes);
            };
            for (const std::size_t branching : {std::size_t{4}, std::size_t{8}, std::size_t{16}}) {
                line(fmt::format("pyramid, branching {}", branching),
                     measure_pyramid(leaves, branching, keys, sorted),
                     8.0 / static_cast<double>(branching - 1));
            }
            line("flat offsets", measure_offsets(leaves, keys, sorted), 8);
        }
    }
    if (sink == 0) fmt::print("\n");
}

}  // namespace
}  // namespace marrow::bench

int main() {
    marrow::bench::run();
}
