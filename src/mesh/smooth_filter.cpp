// Evaluates a polynomial of the averaging operator A of a mesh, which takes a point halfway to the mean of
// its neighbours: the sum of c_n T_n(A) x with the Chebyshev polynomials T_n, from
//
//     T_n+1(A) x = 2 A T_n(A) x - T_n-1(A) x
//
// The filter computes with the displacements d_n = T_n(A) x - x, which are small, so that float is precise
// enough. With d_0 = 0 and the step s = A x - x,
//
//     d_1 = s,   d_n+1 = 2 s + 2 A d_n - d_n-1
//
// A pass computes d_n+1 from d_n. It reads the neighbours, which are nearby in memory if the mesh is ordered
// by position. So several passes go over the points together, each some way behind the one before it.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/smooth_filter.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "base/parallel.h"
#include "smooth_filter.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Applies pass n to the points [begin, end), and adds `coefficient` times their d_n+1 to the sums.
void run_pass(FilterState& state, int n, float coefficient, std::size_t begin, std::size_t end) {
    const hn::CappedTag<float, 4> d;
    const Displacement* const from = state.d[n % 2].data();
    Displacement* const to = state.d[1 - n % 2].data();
    const auto two = hn::Set(d, 2), scale = hn::Set(d, coefficient);
    for (std::size_t p = begin; p < end; ++p) {
        if (!state.rings.is_regular(p)) continue;
        const std::span<const std::uint32_t> ring = state.rings.of(p);
        const auto share = hn::Set(d, ring.empty() ? 0 : 1 / static_cast<float>(ring.size()));
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            auto around = hn::Zero(d);
            for (const std::uint32_t q : ring) around = hn::Add(around, hn::Load(d, from[q].xyz + i));
            const auto twice_average = hn::Add(hn::Load(d, from[p].xyz + i), hn::Mul(share, around));
            const auto next = hn::Add(hn::Mul(two, hn::Load(d, state.step[p].xyz + i)),
                                      hn::Sub(twice_average, hn::Load(d, to[p].xyz + i)));
            hn::Store(next, d, to[p].xyz + i);
            hn::Store(hn::Add(hn::Load(d, state.sum[p].xyz + i), hn::Mul(scale, next)), d,
                      state.sum[p].xyz + i);
        }
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {
namespace {

HWY_EXPORT(run_pass);

// Returns the Chebyshev coefficients of a low-pass filter: the ideal filter that cuts at the angle `cut`, 0
// to pi, times a Hamming window. They are scaled so that the filter leaves a constant unchanged.
std::vector<double> coefficients(int degree, double cut) {
    using std::numbers::pi;
    std::vector<double> c(static_cast<std::size_t>(degree) + 1);
    double sum = 0;
    for (int n = 0; n <= degree; ++n) {
        const double window = 0.54 + 0.46 * std::cos(n * pi / (degree + 1));
        c[static_cast<std::size_t>(n)] = window * (n == 0 ? cut / pi : 2 * std::sin(n * cut) / (n * pi));
        sum += c[static_cast<std::size_t>(n)];
    }
    for (double& value : c) value /= sum;
    return c;
}

double response(const std::vector<double>& c, double angle) {
    double sum = 0;
    for (std::size_t n = 0; n < c.size(); ++n) sum += c[n] * std::cos(static_cast<double>(n) * angle);
    return sum;
}

// Returns the filter whose response is still almost 1 at the end of the pass band. The response of a short
// filter falls slowly, so a short filter must cut later.
std::vector<double> coefficients_for(int degree, double pass_band) {
    constexpr double kPasses = 0.995;
    const double end = std::acos(1 - pass_band / 2);
    double low = end, high = std::numbers::pi / 2;
    for (int step = 0; step < 40; ++step) {
        const double cut = (low + high) / 2;
        (response(coefficients(degree, cut), end) < kPasses ? low : high) = cut;
    }
    return coefficients(degree, high);
}

template <class F>
void for_each_point(std::size_t count, const F& f) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 4096), [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) f(p);
    });
}

FilterState start(const MeshView& mesh, const OneRings& rings, double first_coefficient) {
    const std::size_t count = rings.size();
    FilterState state{rings,
                      Buffer<Displacement>(count),
                      Buffer<Displacement>(count),
                      {Buffer<Displacement>(count), Buffer<Displacement>(count)}};
    for_each_point(count, [&](std::size_t p) {
        state.step[p] = state.sum[p] = state.d[0][p] = state.d[1][p] = {};
        if (!rings.is_regular(p) || rings.of(p).empty()) return;
        const Vec3d position = to_double(mesh.points[p]);
        Vec3d sum{};
        for (const std::uint32_t q : rings.of(p)) sum = sum + (to_double(mesh.points[q]) - position);
        const double half = 0.5 / static_cast<double>(rings.of(p).size());
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto step = static_cast<float>(half * sum[axis]);
            state.step[p].xyz[axis] = state.d[1][p].xyz[axis] = step;
            state.sum[p].xyz[axis] = static_cast<float>(first_coefficient) * step;
        }
    });
    return state;
}

// Runs several passes over chunks of points.
//
// A chunk may go through a pass when all chunks from the first to the last with neighbours of its points are
// through the pass before. In a band of chunks, a thread goes forward and lets each pass follow the one before
// as closely as this allows, while the points are in the cache. What needs the chunks of other bands is done
// afterwards, pass by pass. If neighbours are far apart in the order of the points, that is nearly everything.
class PassScheduler {
  public:
    static constexpr int kPassesTogether = 5;

    explicit PassScheduler(const OneRings& rings)
        : points_(rings.size()), chunks_((points_ + kChunk - 1) / kChunk) {
        tbb::parallel_for(std::size_t{0}, chunks_.size(), [&](std::size_t c) {
            chunks_[c] = {c, c};
            for (std::size_t p = c * kChunk; p < std::min((c + 1) * kChunk, points_); ++p) {
                for (const std::uint32_t q : rings.of(p)) {
                    chunks_[c].first = std::min(chunks_[c].first, q / kChunk);
                    chunks_[c].last = std::max(chunks_[c].last, q / kChunk);
                }
            }
        });
        // From here on, a chunk needs no chunk before those that the chunk before it needs, and so on.
        for (std::size_t c = chunks_.size(); c-- > 1;)
            chunks_[c - 1].first = std::min(chunks_[c - 1].first, chunks_[c].first);
        for (std::size_t c = 1; c < chunks_.size(); ++c)
            chunks_[c].last = std::max(chunks_[c].last, chunks_[c - 1].last);
    }

    // Calls pass(n, begin, end) for n from 0 to passes - 1 and the points [begin, end) of every chunk.
    // \pre passes <= kPassesTogether
    template <class Pass>
    void run(int passes, const Pass& pass) {
        for (Chunk& chunk : chunks_) chunk.done = 0;
        const auto bands = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
        tbb::parallel_for(std::size_t{0}, bands, [&](std::size_t band) {
            run_band(chunks_.size() * band / bands, chunks_.size() * (band + 1) / bands, passes, pass);
        });
        for (int n = 0; n < passes; ++n) {
            tbb::parallel_for(std::size_t{0}, chunks_.size(), [&](std::size_t c) {
                if (chunks_[c].done == n) run_chunk(c, pass);
            });
        }
    }

  private:
    static constexpr std::size_t kChunk = 512;
    struct Chunk {
        std::size_t first, last;  // the chunks with neighbours of its points
        int done = 0;             // the passes that it is through
    };

    template <class Pass>
    void run_chunk(std::size_t c, const Pass& pass) {
        pass(chunks_[c].done++, c * kChunk, std::min((c + 1) * kChunk, points_));
    }

    template <class Pass>
    void run_band(std::size_t begin, std::size_t end, int passes, const Pass& pass) {
        // What each pass can do within the band, and which chunk is next.
        std::array<std::size_t, kPassesTogether> next, stop;
        next[0] = begin;
        stop[0] = end;
        const auto count = static_cast<std::size_t>(passes);
        for (std::size_t n = 1; n < count; ++n) {
            next[n] = next[n - 1];
            while (next[n] < end && chunks_[next[n]].first < next[n - 1]) ++next[n];
            stop[n] = stop[n - 1];
            while (stop[n] > next[n] && chunks_[stop[n] - 1].last >= stop[n - 1]) --stop[n];
        }
        while (next[0] < end) {
            for (std::size_t n = 0; n < count; ++n) {
                while (next[n] < stop[n] && (n == 0 || chunks_[next[n]].last < next[n - 1])) {
                    run_chunk(next[n]++, pass);
                    if (n == 0) break;
                }
            }
        }
    }

    std::size_t points_;
    std::vector<Chunk> chunks_;
};

}  // namespace

Buffer<Displacement> low_pass(const MeshView& mesh, const OneRings& rings, int degree, double pass_band,
                              const Progress& progress) {
    const std::vector<double> c = coefficients_for(degree, pass_band);
    FilterState state = start(mesh, rings, c[1]);
    PassScheduler scheduler(rings);
    constexpr int kTogether = PassScheduler::kPassesTogether;
    for (int first = 1; first < degree; first += kTogether) {
        report_progress(progress, static_cast<double>(first) / degree);
        scheduler.run(std::min(kTogether, degree - first), [&](int n, std::size_t begin, std::size_t end) {
            const int pass = first + n;
            const auto coefficient = static_cast<float>(c[static_cast<std::size_t>(pass) + 1]);
            HWY_DYNAMIC_DISPATCH(run_pass)(state, pass, coefficient, begin, end);
        });
    }
    return std::move(state.sum);
}

}  // namespace marrow::internal
#endif
