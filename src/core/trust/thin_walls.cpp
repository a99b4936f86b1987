// Finds walls that fall below the isovalue beside a surface, and restores them.
#include <marrow/thin_walls.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <numeric>
#include <optional>
#include <tuple>

#include <marrow/error.h>
#include <marrow/trust.h>
#include <marrow/volume_filters.h>

#include "base/all_finite.h"
#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "core/volume/checks.h"
#include "peaks.h"
#include "ridges.h"
#include "sample_mask.h"

namespace marrow {

using namespace internal;

namespace {

using Index = std::array<std::int64_t, 3>;

constexpr std::ptrdiff_t kFewestSamples = 5;  // of a wall

// By (z, y, x).
bool is_before(const Index& a, const Index& b) {
    return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
}

// Calls f with the neighbours of a sample that are in the volume: up to 26.
template <class F>
void for_each_neighbour(const Index& index, const Index& dims, const F& f) {
    for (std::int64_t z = std::max<std::int64_t>(index[2] - 1, 0); z <= std::min(index[2] + 1, dims[2] - 1);
         ++z) {
        for (std::int64_t y = std::max<std::int64_t>(index[1] - 1, 0);
             y <= std::min(index[1] + 1, dims[1] - 1); ++y) {
            for (std::int64_t x = std::max<std::int64_t>(index[0] - 1, 0);
                 x <= std::min(index[0] + 1, dims[0] - 1); ++x) {
                if (const Index neighbour{x, y, z}; neighbour != index) f(neighbour);
            }
        }
    }
}

// The samples beside the points of the surface: all that have a neighbour inside, and others.
SampleMask beside_surface(const VolumeView& volume, std::span<const Vec3f> points) {
    const Geometry geometry = volume.own_geometry();
    const Mat3d to_index = inverse(geometry.index_to_physical());
    SampleMask mask(geometry.dims);
    for (const Vec3f& point : points)
        mask.insert(samples_at(to_index * (to_double(point) - geometry.origin), geometry.dims));
    mask.dilate();
    return mask;
}

// The ridges among the candidates of a slice that have a neighbour inside the surface. The words of
// candidates then hold the peaks of all their samples instead.
template <class T>
std::vector<Ridge> first_ridges(const VolumeView& volume, const RidgeTest<T>& ridge_at,
                                SampleMask& candidates, std::int64_t z) {
    const Index& dims = volume.geometry.dims;
    std::vector<Ridge> found;
    std::vector<std::uint64_t> peaks;
    for (std::int64_t y = 0; y < dims[1]; ++y) {
        if (!candidates.has_row(y, z)) continue;
        const std::span<std::uint64_t> row = candidates.row(y, z);
        peaks.resize(row.size());
        std::transform(row.begin(), row.end(), peaks.begin(),
                       [](std::uint64_t word) { return word != 0 ? ~std::uint64_t{0} : 0; });
        keep_peaks(volume, ridge_at.limits(), y, z, peaks.data());
        for (std::size_t w = 0; w < peaks.size(); ++w) {
            const std::uint64_t candidate_peaks = peaks[w] & row[w];
            if (row[w] != 0) row[w] = peaks[w];
            for (std::uint64_t left = candidate_peaks; left != 0; left &= left - 1) {
                const Index index{static_cast<std::int64_t>(64 * w) + std::countr_zero(left), y, z};
                const std::optional<Ridge> ridge = ridge_at(index);
                if (!ridge) continue;
                bool inside = false;
                for_each_neighbour(index, dims,
                                   [&](const Index& i) { inside = inside || ridge_at.is_inside(i); });
                if (inside) found.push_back(*ridge);
            }
        }
    }
    return found;
}

// Lets long work on ridges be cancelled whose progress is not known.
class Checkpoints {
  public:
    Checkpoints(const Progress& progress, double fraction) : progress_(progress), fraction_(fraction) {}

    // Counts a ridge. \throw Cancelled
    void pass() {
        if (++count_ % 4096 == 0) report_progress(progress_, fraction_);
    }

  private:
    const Progress& progress_;
    const double fraction_;
    std::size_t count_ = 0;
};

// Follows walls from the first ridges to neighbouring sheets, adds the ridges among at least three sheets,
// and orders all. Where a word of `peaks` has any, it has all: other samples of the word are no ridges.
template <class T>
void follow_walls(const RidgeTest<T>& ridge_at, const SampleMask& peaks, const Index& dims,
                  std::vector<Ridge>& ridges, Checkpoints& checkpoints) {
    const auto may_be_ridge = [&](const Index& index) {
        const std::uint64_t word = peaks.word(index[0], index[1], index[2]);
        return word == 0 || (word >> (index[0] % 64) & 1) != 0;
    };
    SampleMask seen(dims), sheets(dims);
    for (const Ridge& ridge : ridges) seen.insert(ridge.sample.index);
    std::vector<Ridge> others;
    for (std::size_t i = 0; i < ridges.size(); ++i) {
        checkpoints.pass();
        const Index index = ridges[i].sample.index;  // a copy, because ridges grows
        if (ridges[i].is_sheet) sheets.insert(index);
        for_each_neighbour(index, dims, [&](const Index& neighbour) {
            if (!may_be_ridge(neighbour) || seen.has(neighbour)) return;
            seen.insert(neighbour);
            const std::optional<Ridge> ridge = ridge_at(neighbour);
            if (ridge) (ridge->is_sheet ? ridges : others).push_back(*ridge);
        });
    }
    const auto sheets_around = [&](const Ridge& ridge) {
        checkpoints.pass();
        int count = 0;
        for_each_neighbour(ridge.sample.index, dims, [&](const Index& i) { count += sheets.has(i); });
        return count;
    };
    std::erase_if(ridges, [&](const Ridge& ridge) { return !ridge.is_sheet && sheets_around(ridge) == 0; });
    for (const Ridge& ridge : others) {
        if (sheets_around(ridge) >= 3) ridges.push_back(ridge);
    }
    std::sort(ridges.begin(), ridges.end(),
              [](const Ridge& a, const Ridge& b) { return is_before(a.sample.index, b.sample.index); });
}

// Calls f(i, k) for all neighbouring ridges with k < i. They are ordered, so those before a ridge are the
// last one and those in four earlier rows, whose places in the list only grow.
template <class F>
void for_each_pair(const std::vector<Ridge>& ridges, const F& f) {
    constexpr std::array<std::array<std::int64_t, 2>, 4> kEarlierRows{{{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    std::array<std::size_t, 4> first{};
    const auto index_of = [&](std::size_t i) -> const Index& { return ridges[i].sample.index; };
    for (std::size_t i = 0; i < ridges.size(); ++i) {
        const auto [x, y, z] = index_of(i);
        if (i > 0 && index_of(i - 1) == Index{x - 1, y, z}) f(i, i - 1);
        for (std::size_t row = 0; row < kEarlierRows.size(); ++row) {
            const auto [dy, dz] = kEarlierRows[row];
            const Index begin{x - 1, y + dy, z + dz}, last{x + 1, y + dy, z + dz};
            std::size_t& k = first[row];
            while (is_before(index_of(k), begin)) ++k;
            for (std::size_t other = k; !is_before(last, index_of(other)); ++other) f(i, other);
        }
    }
}

// The ridges of each wall: those that are connected, where the rim of a wall is connected only to its sheet.
std::vector<std::vector<Ridge>> connected_walls(const std::vector<Ridge>& ridges, Checkpoints& checkpoints) {
    std::vector<std::size_t> parents(ridges.size());
    std::iota(parents.begin(), parents.end(), std::size_t{0});
    for_each_pair(ridges, [&](std::size_t i, std::size_t other) {
        checkpoints.pass();
        if (ridges[i].is_sheet || ridges[other].is_sheet) unite(parents, i, other);
    });
    std::map<std::size_t, std::vector<Ridge>> by_first;
    for (std::size_t i = 0; i < ridges.size(); ++i) {
        checkpoints.pass();
        by_first[representative(parents, i)].push_back(ridges[i]);
    }
    std::vector<std::vector<Ridge>> walls;
    for (auto& [first, wall] : by_first) walls.push_back(std::move(wall));
    return walls;
}

Vec3d to_vector(const Index& index) {
    return {static_cast<double>(index[0]), static_cast<double>(index[1]), static_cast<double>(index[2])};
}

// The area of a wall, and its sample that is nearest to the mean of all.
ThinWall summary(const std::vector<Ridge>& wall, const Geometry& geometry) {
    ThinWall result;
    Vec3d sum{0, 0, 0};
    for (const auto& [sample, is_sheet] : wall) {
        result.area += sample.area;
        sum = sum + sample.area * geometry.physical(to_vector(sample.index));
    }
    const Vec3d mean = (1 / result.area) * sum;
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [sample, is_sheet] : wall) {
        const Vec3d position = geometry.physical(to_vector(sample.index));
        if (const double distance = length(position - mean); distance < nearest) {
            nearest = distance;
            result.position = position;
        }
    }
    return result;
}

ThinWalls summary(const std::vector<Ridge>& ridges, const VolumeView& volume, Checkpoints& checkpoints) {
    const Geometry geometry = volume.own_geometry();
    ThinWalls found;
    for (const std::vector<Ridge>& wall : connected_walls(ridges, checkpoints)) {
        checkpoints.pass();
        const auto sheets =
            std::count_if(wall.begin(), wall.end(), [](const Ridge& r) { return r.is_sheet; });
        if (sheets < kFewestSamples) continue;
        found.walls.push_back(summary(wall, geometry));
        found.area += found.walls.back().area;
        for (const Ridge& ridge : wall) found.samples.push_back(ridge.sample);
    }
    std::stable_sort(found.walls.begin(), found.walls.end(),
                     [](const ThinWall& a, const ThinWall& b) { return a.area > b.area; });
    std::sort(found.samples.begin(), found.samples.end(),
              [](const RidgeSample& a, const RidgeSample& b) { return is_before(a.index, b.index); });
    return found;
}

template <class T>
ThinWalls find(const VolumeView& volume, double isovalue, double noise, std::optional<double> padding,
               MeshView surface, const Progress& progress) {
    const Index dims = volume.geometry.dims;
    const RidgeTest<T> ridge_at(volume, isovalue, noise, padding);
    SampleMask candidates = beside_surface(volume, surface.points);
    std::vector<std::vector<Ridge>> by_slice(static_cast<std::size_t>(dims[2]));
    constexpr double kFirstRidges = 0.9;  // of the time, usually
    Stage stage(progress, 0, kFirstRidges, by_slice.size());
    parallel_for(std::size_t{0}, by_slice.size(), [&](std::size_t z) {
        by_slice[z] = first_ridges(volume, ridge_at, candidates, static_cast<std::int64_t>(z));
        stage.step();
    });
    std::vector<Ridge> ridges;
    for (const std::vector<Ridge>& slice : by_slice) ridges.insert(ridges.end(), slice.begin(), slice.end());
    Checkpoints checkpoints(progress, kFirstRidges);
    follow_walls(ridge_at, candidates, dims, ridges, checkpoints);
    ThinWalls found = summary(ridges, volume, checkpoints);
    report_progress(progress, 1);
    return found;
}

template <class T>
T to_sample(double value) {
    if constexpr (std::is_integral_v<T>) {
        return static_cast<T>(std::clamp(std::round(value),
                                         static_cast<double>(std::numeric_limits<T>::lowest()),
                                         static_cast<double>(std::numeric_limits<T>::max())));
    } else {
        return static_cast<T>(value);
    }
}

// Raises the samples across a wall so that they reach the isovalue where they are half way up to its peak.
template <class T>
void restore(const VolumeView& volume, double isovalue, const RidgeSample& ridge, Volume& result) {
    const RidgeProfile<T> profile(volume);
    const std::int64_t pitch = profile.pitches[ridge.axis];
    const T* const sample = profile.at(ridge.index);
    const auto value = [&](std::int64_t step) { return static_cast<double>(sample[step * pitch]); };
    // The peak lies between samples: that of the parabola through three of them.
    const double rise = value(1) - value(-1), bend = 2 * value(0) - value(1) - value(-1);
    const double peak = value(0) + (bend > 0 ? rise * rise / (8 * bend) : 0);
    const Index& dims = volume.geometry.dims;
    const auto raise = [&](std::int64_t step, double to) {
        Index index = ridge.index;
        index[ridge.axis] += step;
        T& out = result.samples<T>()[(index[2] * dims[1] + index[1]) * dims[0] + index[0]];
        out = std::max(out, to_sample<T>(to));
    };
    double least_shift = std::numeric_limits<double>::infinity();
    for (const int sign : {-1, 1}) {
        const RidgeSide side = profile.side(ridge.index, ridge.axis, sign);
        const double shift = isovalue - (peak + side.lowest) / 2;
        least_shift = std::min(least_shift, shift);
        for (std::int64_t step = 1; step <= side.steps; ++step)
            raise(sign * step, value(sign * step) + shift);
    }
    raise(0, value(0) + least_shift);
}

}  // namespace

ThinWalls find_thin_walls(const VolumeView& volume, double isovalue, MeshView surface,
                          const ThinWallOptions& options) {
    check_volume(volume);
    if (!all_finite(surface.points))
        throw InputError("thin walls: a coordinate of the surface is NaN or infinite");
    if (options.noise && !(*options.noise >= 0 && std::isfinite(*options.noise)))
        throw InputError("thin walls: options.noise must be finite and at least 0");
    const double sample_isovalue = checked_isovalue(isovalue, volume.rescale);
    if (volume.geometry.sample_count() == 0) return {};
    const double estimated = options.noise ? 0 : 0.5;  // the part of the progress
    const double noise =
        options.noise ? *options.noise
                      : estimate_noise(volume, {.padding = options.padding,
                                                .threads = options.threads,
                                                .progress = sub_progress(options.progress, 0, estimated)})
                            .sigma;
    const double sample_noise = noise / volume.rescale.slope;
    const Progress progress = sub_progress(options.progress, estimated, 1);
    ThinWalls found;
    try {
        with_threads(options.threads, [&] {
            visit_sample_type(volume.type, [&]<class T>(T) {
                found = find<T>(volume, sample_isovalue, sample_noise, options.padding, surface, progress);
            });
        });
    } catch (const std::bad_alloc&) {
        throw_out_of_memory(volume.geometry);
    }
    return found;
}

Volume restore_thin_walls(const VolumeView& volume, double isovalue, const ThinWalls& walls,
                          const Progress& progress) {
    check_volume(volume);
    const double sample_isovalue = checked_isovalue(isovalue, volume.rescale);
    Volume result =
        crop(volume, {0, 0, 0},
             {volume.geometry.dims[0] - 1, volume.geometry.dims[1] - 1, volume.geometry.dims[2] - 1});
    Checkpoints checkpoints(progress, 0.5);
    visit_sample_type(volume.type, [&]<class T>(T) {
        for (const RidgeSample& ridge : walls.samples) {
            checkpoints.pass();
            restore<T>(volume, sample_isovalue, ridge, result);
        }
    });
    report_progress(progress, 1);
    return result;
}

std::vector<bool> near_thin_walls(const VolumeView& volume, const ThinWalls& walls,
                                  std::span<const Vec3f> points) {
    check_volume(volume);
    std::vector<bool> near(points.size());
    if (walls.samples.empty()) return near;
    const Geometry geometry = volume.own_geometry();
    const Mat3d to_index = inverse(geometry.index_to_physical());
    SampleMask mask(geometry.dims);
    for (const RidgeSample& sample : walls.samples) mask.insert(sample.index);
    mask.dilate();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3d index = to_index * (to_double(points[i]) - geometry.origin);
        bool near_volume = true;  // NaN is not
        for (std::size_t a = 0; a < 3; ++a)
            near_volume &= index[a] >= -1 && index[a] <= static_cast<double>(geometry.dims[a]);
        near[i] = near_volume && mask.has_any(samples_at(index, geometry.dims));
    }
    return near;
}

}  // namespace marrow
