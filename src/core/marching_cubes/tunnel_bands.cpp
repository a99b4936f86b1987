// Finds the shortest bands by dynamic programming over the points of a loop, with a
// start in each lane of vectors. The few cells that need others list them all.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/marching_cubes/tunnel_bands.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

#include "tunnel_bands.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Starts = hn::CappedTag<double, BandsOfStarts::kStarts>;
using StartVec = hn::Vec<Starts>;

// The distances of the loop's points from the ring's points, which go round more than twice.
struct Rounds {
    static constexpr std::size_t kPoints = 2 * Band::kRing + BandsOfStarts::kStarts;
    double squared[kCellEdges][kPoints];

    Rounds(const Band::Distances& once, std::size_t size) {
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t k = 0; k < kPoints; ++k)
                squared[i][k] = k < Band::kRing ? once[i][k] : squared[i][k - Band::kRing];
        }
    }
    // From the point that each start reaches after so many steps.
    HWY_INLINE StartVec after(std::size_t point, std::size_t steps, bool backwards,
                              std::size_t first_start) const {
        return hn::LoadU(Starts(), squared[point] + first_start + (backwards ? Band::kRing - steps : steps));
    }
};

HWY_INLINE void find_bands_of(const Rounds& rounds, std::size_t size, bool backwards, std::size_t first_start,
                              BandsOfStarts& bands) {
    constexpr std::size_t kPlaces = BandsOfStarts::kPlaces;
    const Starts d;
    const auto unreachable = hn::Set(d, 1e300);
    // The cost of the links until a point of the loop is linked with the ring's point at each place.
    StartVec cost[kPlaces], here[kPlaces], next[kPlaces];
    const auto find_links = [&](std::size_t point, StartVec(&links)[kPlaces]) HWY_ATTR {
        for (std::size_t j = 0; j < kPlaces; ++j) links[j] = rounds.after(point, j, backwards, first_start);
    };
    for (std::size_t j = 0; j < kPlaces; ++j) cost[j] = j == 0 ? hn::Zero(d) : unreachable;
    find_links(0, next);
    for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t j = 0; j < kPlaces; ++j) here[j] = next[j];
        find_links(i + 1 < size ? i + 1 : 0, next);
        // Two steps at each point must lead here, and from here to the end.
        const std::size_t to_come = 2 * (size - 1 - i);
        const std::size_t least = to_come < Band::kRing ? Band::kRing - to_come : 0;
        const std::size_t most = std::min(2 * (i + 1), Band::kRing);
        // Downwards, so that the costs before are still those of the last point.
        for (std::size_t j = most + 1; j-- > least;) {
            auto best = unreachable, steps = hn::Set(d, 2.0);
            if (j >= 2) best = hn::Add(hn::Add(hn::Add(cost[j - 2], here[j - 1]), here[j]), next[j]);
            if (j >= 1) {
                const auto after_one = hn::Add(hn::Add(cost[j - 1], here[j]), next[j]);
                const auto shorter = hn::Lt(after_one, best);
                best = hn::IfThenElse(shorter, after_one, best);
                steps = hn::IfThenElse(shorter, hn::Set(d, 1.0), steps);
            }
            const auto after_none = hn::Add(cost[j], next[j]);
            const auto shorter = hn::Lt(after_none, best);
            cost[j] = hn::IfThenElse(shorter, after_none, best);
            hn::Store(hn::IfThenZeroElse(shorter, steps), d, bands.steps[backwards][i][j] + first_start);
        }
        for (std::size_t j = 0; j < least; ++j) cost[j] = unreachable;
    }
    hn::Store(cost[Band::kRing], d, bands.cost[backwards] + first_start);
}

void find_bands(const Band::Distances& squared, std::size_t size, BandsOfStarts& bands) {
    const Rounds rounds(squared, size);
    for (std::size_t first = 0; first < Band::kRing; first += hn::Lanes(Starts())) {
        find_bands_of(rounds, size, false, first, bands);
        find_bands_of(rounds, size, true, first, bands);
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_bands);

std::array<Band, 2> shortest_bands(const Band::Distances& squared, std::size_t size) {
    BandsOfStarts bands;
    HWY_DYNAMIC_DISPATCH(find_bands)(squared, size, bands);
    std::array<Band, 2> best;
    for (std::size_t backwards = 0; backwards < 2; ++backwards) {
        Band& band = best[backwards];
        band.direction = backwards == 0 ? 1 : Band::kRing - 1;
        const auto& cost = bands.cost[backwards];
        for (std::size_t start = 1; start < Band::kRing; ++start) {
            if (cost[start] < cost[band.start]) band.start = start;
        }
        band.cost = cost[band.start];
        std::size_t place = Band::kRing;
        for (std::size_t i = size; i > 0; --i) {
            band.steps[i - 1] = static_cast<std::uint8_t>(bands.steps[backwards][i - 1][place][band.start]);
            place -= band.steps[i - 1];
        }
    }
    return best;
}

namespace {

// Adds the bands that begin like this one, which has come to a point of the loop and a place on the ring.
void continue_band(const Band::Distances& squared, std::size_t size, Band band, std::size_t point,
                   std::size_t place, std::vector<Band>& bands) {
    if (point == size) {
        bands.push_back(band);
        return;
    }
    const std::size_t next = point + 1 < size ? point + 1 : 0, last = Band::kRing,
                      to_come = 2 * (size - 1 - point);
    for (std::uint8_t steps = 0; steps <= 2 && place <= last; ++steps, ++place) {
        if (steps > 0) band.cost += squared[point][band.ring_point(place)];
        if (place + to_come < last) continue;
        Band longer = band;
        longer.steps[point] = steps;
        longer.cost += squared[next][band.ring_point(place)];
        continue_band(squared, size, longer, point + 1, place, bands);
    }
}

}  // namespace

std::vector<Band> all_bands(const Band::Distances& squared, std::size_t size, bool backwards) {
    std::vector<Band> bands;
    for (std::size_t start = 0; start < Band::kRing; ++start) {
        continue_band(squared, size, {.start = start, .direction = backwards ? Band::kRing - 1 : 1}, 0, 0,
                      bands);
    }
    std::stable_sort(bands.begin(), bands.end(),
                     [](const Band& a, const Band& b) { return a.cost < b.cost; });
    return bands;
}

}  // namespace marrow::internal
#endif
