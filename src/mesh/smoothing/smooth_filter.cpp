// Evaluates a polynomial of the averaging operator A of a mesh, which takes a point halfway to the mean of
// its neighbours: the sum of c_n T_n(A) x with the Chebyshev polynomials T_n, where the c_n add up to 1.
//
// The filter computes with displacements, which are small, so that float is precise enough. Since
// T_n(A) - 1 = (A - 1) (U_n-1(A) + 2 U_n-2(A) + ... + 2 U_0(A)) with the Chebyshev polynomials of the second
// kind, points move by the sum of e_n U_n(A) s, where
//
//     s = A x - x,   e_n = c_n+1 + 2 (c_n+2 + c_n+3 + ...)
//
// This is the last value b_0 of Clenshaw's recurrence, which begins with zeros:
//
//     b_n = e_n s + 2 A b_n+1 - b_n+2
//
// A pass computes b_n from b_n+1. It reads the neighbours, which are nearby in memory if the mesh is ordered
// by position. So several passes go over the points together, each some way behind the one before it.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/smoothing/smooth_filter.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "smooth_filter.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Computes s at a point from the positions `from`, and the first value of the recurrence.
struct Start {
    Displacement* step;
    const Displacement* from;
    Displacement* to;
    float coefficient;

    template <class D>
    HWY_INLINE void operator()(D d, std::uint32_t p, const std::uint32_t* ring, std::size_t count) const {
        const auto share = hn::Set(d, 0.5f / static_cast<float>(count));
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            const auto at = hn::Load(d, from[p].xyz + i);
            auto sum = hn::Zero(d);
            for (std::size_t n = 0; n < count; ++n)
                sum = hn::Add(sum, hn::Sub(hn::Load(d, from[ring[n]].xyz + i), at));
            const auto move = hn::Mul(share, sum);
            hn::Store(move, d, step[p].xyz + i);
            hn::Store(hn::Mul(hn::Set(d, coefficient), move), d, to[p].xyz + i);
        }
    }
};

// Computes b_n at a point from b_n+1, and from b_n+2, which it replaces. In the
// first pass, the latter is zero.
template <bool kFirst>
struct Step {
    const Displacement *step, *from;
    Displacement* to;
    float coefficient;

    template <class D>
    HWY_INLINE void operator()(D d, std::uint32_t p, const std::uint32_t* ring, std::size_t count) const {
        const auto share = hn::Set(d, 1 / static_cast<float>(count));
        for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
            // Two sums, because an addition takes longer than a load.
            auto even = hn::Zero(d), odd = hn::Zero(d);
            for (std::size_t n = 0; n + 1 < count; n += 2) {
                even = hn::Add(even, hn::Load(d, from[ring[n]].xyz + i));
                odd = hn::Add(odd, hn::Load(d, from[ring[n + 1]].xyz + i));
            }
            if (count % 2 == 1) even = hn::Add(even, hn::Load(d, from[ring[count - 1]].xyz + i));
            const auto twice_average =
                hn::Add(hn::Load(d, from[p].xyz + i), hn::Mul(share, hn::Add(even, odd)));
            auto part = hn::Mul(hn::Set(d, coefficient), hn::Load(d, step[p].xyz + i));
            if (!kFirst) part = hn::Sub(part, hn::Load(d, to[p].xyz + i));
            hn::Store(hn::Add(part, twice_average), d, to[p].xyz + i);
        }
    }
};

// Applies a step to the fans of a chunk with this number of neighbours.
template <std::size_t kNeighbours, class Step>
HWY_INLINE void apply_to_fans(const OneRings& rings, std::size_t chunk, const Step& wanted) {
    const std::span<const std::uint32_t> points = rings.listed(chunk, kNeighbours);
    if (points.empty()) return;
    const std::uint32_t* ring = rings.of(points[0]).data();
    const Step step = wanted;  // so that it is in registers
    for (const std::uint32_t p : points) {
        step(hn::CappedTag<float, 4>(), p, ring, kNeighbours);
        ring += kNeighbours;
    }
}

template <class Step, std::size_t... kNeighbours>
HWY_INLINE void apply_to_all_fans(const OneRings& rings, std::size_t chunk, const Step& step,
                                  std::index_sequence<kNeighbours...>) {
    (apply_to_fans<kNeighbours + 1>(rings, chunk, step), ...);
}

// Applies a step to the points of a chunk that move, and `stay` to the others.
template <class Step, class Stay>
HWY_INLINE void apply(const OneRings& rings, std::size_t chunk, const Step& step, const Stay& stay) {
    for (const std::uint32_t p : rings.listed(chunk, 0)) {
        const std::span<const std::uint32_t> ring = rings.of(p);
        if (rings.is_regular(p) && !ring.empty())
            step(hn::CappedTag<float, 4>(), p, ring.data(), ring.size());
        else
            stay(p);
    }
    apply_to_all_fans(rings, chunk, step, std::make_index_sequence<OneRings::kMostInFan>());
}

// Runs pass n of a filter over a chunk. Pass 0 starts it, from the positions in b[1].
void run_pass(const OneRings& rings, std::size_t chunk, std::size_t n, float coefficient, Displacement* step,
              Displacement* const (&b)[2]) {
    Displacement *const from = b[(n + 1) % 2], *const to = b[n % 2];
    if (n == 0)
        apply(rings, chunk, Start{step, from, to, coefficient},
              [&](std::uint32_t p) { step[p] = to[p] = {}; });
    else if (n == 1)
        apply(rings, chunk, Step<true>{step, from, to, coefficient}, [&](std::uint32_t p) { to[p] = {}; });
    else
        apply(rings, chunk, Step<false>{step, from, to, coefficient}, [](std::uint32_t) {});
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

// Returns the factors e_n of the steps.
std::vector<float> step_coefficients(int degree, double pass_band) {
    const std::vector<double> c = coefficients_for(degree, pass_band);
    std::vector<float> e(static_cast<std::size_t>(degree));
    double after = 0;
    for (std::size_t n = e.size(); n-- > 0;) {
        e[n] = static_cast<float>(c[n + 1] + 2 * after);
        after += c[n + 1];
    }
    return e;
}

// Runs several passes over the chunks of points.
//
// A chunk may go through a pass when all chunks from the first to the last with neighbours of its points are
// through the pass before. In a band of chunks, a thread goes forward and lets each pass follow the
// one before as closely as this allows, while the points are in the cache. What needs the chunks of
// other bands is done afterwards, pass by pass. If neighbours are far apart in the order of the
// points, that is nearly everything.
class PassScheduler {
  public:
    static constexpr int kPassesTogether = 20;

    explicit PassScheduler(const OneRings& rings) {
        for (std::size_t c = 0; c < rings.chunks(); ++c) {
            const auto [lowest, highest] = rings.reach(c);
            chunks_.push_back({lowest / OneRings::kChunk, highest / OneRings::kChunk});
        }
        // From here on, a chunk needs no chunk before those that the chunk before it needs, and so on.
        for (std::size_t c = chunks_.size(); c-- > 1;)
            chunks_[c - 1].first = std::min(chunks_[c - 1].first, chunks_[c].first);
        for (std::size_t c = 1; c < chunks_.size(); ++c)
            chunks_[c].last = std::max(chunks_[c].last, chunks_[c - 1].last);
    }

    // Calls pass(n, chunk) for n from 0 to passes - 1 and every chunk.
    // \pre passes <= kPassesTogether
    template <class Pass>
    void run(int passes, const Pass& pass) {
        for (Chunk& chunk : chunks_) chunk.done = 0;
        const auto bands = static_cast<std::size_t>(thread_count());
        parallel_for(std::size_t{0}, bands, [&](std::size_t band) {
            run_band(chunks_.size() * band / bands, chunks_.size() * (band + 1) / bands, passes, pass);
        });
        for (int n = 0; n < passes; ++n) {
            parallel_for(std::size_t{0}, chunks_.size(), [&](std::size_t c) {
                if (chunks_[c].done == n) run_chunk(c, pass);
            });
        }
    }

  private:
    struct Chunk {
        std::size_t first, last;  // the chunks with neighbours of its points
        int done = 0;             // the passes that it is through
    };

    template <class Pass>
    void run_chunk(std::size_t c, const Pass& pass) {
        pass(chunks_[c].done++, c);
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

    std::vector<Chunk> chunks_;
};

}  // namespace

Buffer<Displacement> low_pass(const MeshView& mesh, const OneRings& rings, int degree, double pass_band,
                              const Progress& progress) {
    const std::vector<float> e = step_coefficients(degree, pass_band);
    Buffer<Displacement> step(rings.size()), even(rings.size()), odd(rings.size());
    Displacement* const b[2] = {even.data(), odd.data()};
    parallel_for_ranges(std::size_t{0}, rings.size(), 4096, [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p)
            odd[p] = {{mesh.points[p][0], mesh.points[p][1], mesh.points[p][2], 0}};
    });
    PassScheduler scheduler(rings);
    Stage stage(progress, 0, 1, static_cast<std::size_t>(degree) * rings.chunks());
    constexpr int kTogether = PassScheduler::kPassesTogether;
    for (int first = 0; first < degree; first += kTogether) {
        scheduler.run(std::min(kTogether, degree - first), [&](int n, std::size_t chunk) {
            const auto pass = static_cast<std::size_t>(first + n);
            HWY_DYNAMIC_DISPATCH(run_pass)(rings, chunk, pass, e[e.size() - 1 - pass], step.data(), b);
            stage.step();
        });
    }
    return degree % 2 == 1 ? std::move(even) : std::move(odd);
}

}  // namespace marrow::internal
#endif
