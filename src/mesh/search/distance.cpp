// Spreads samples over each surface and measures their distances to the other surface.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <marrow/error.h>
#include <marrow/measure.h>

#include "base/checked_size.h"
#include "base/for_each_range.h"
#include "base/parallel.h"
#include "distance.h"
#include "mesh/connectivity/check_mesh.h"
#include "mesh/geometry/triangle_corners.h"

namespace marrow {

using namespace internal;

namespace {

// The leaves of the tree that a thread looks at together.
constexpr std::size_t kLeaves = 32;
// How many leaves ahead the positions of a leaf are fetched.
constexpr std::size_t kAhead = 2;

// \pre x >= 0
double fraction(double x) {
    return x - static_cast<double>(static_cast<std::int64_t>(x));  // std::floor is a call of the C library
}

// The k-th position in a triangle, of the additive sequence of the plastic number (Roberts 2018).
Vec3d spread_position(const TriangleCorners& t, double k) {
    double u = fraction(0.7548776662466927 * k), v = fraction(0.5698402909980532 * k);
    // Beyond the triangle, 1 - u and 1 - v are within it. This happens half of the time, so there is no
    // branch.
    const double beyond = u + v > 1 ? 1 : 0;
    u = std::abs(beyond - u), v = std::abs(beyond - v);
    return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
}

// A position of a mesh.
struct Source {
    std::uint32_t triangle;
    std::uint8_t corner;  // of the triangle; kSample: it is a sample
    std::size_t sample;

    static constexpr std::uint8_t kSample = 3;
};

// Positions that are near each other.
struct Group {
    std::array<NearestQuery, kMostInGroup> queries;
    std::array<Source, kMostInGroup> sources;
    std::size_t size = 0;
    double reach = 0;  // how far to look for what is nearest to them; kept from group to group

    void add(const Vec3d& position, const Source& source) {
        queries[size].position = position;
        sources[size++] = source;
    }
    std::span<NearestQuery> all() { return {queries.data(), size}; }
};

// Calls f(group, range) for all positions that are wanted, on all threads. Each range is on one thread.
template <class Wanted, class F>
void for_each_group(const SampledMesh& from, const Wanted& wanted, const Progress& progress, double begin,
                    double end, const F& f) {
    const std::span<const BoxTree::Leaf> leaves = from.tree().leaves();
    for_each_range(leaves.size(), kLeaves, progress, begin, end, [&](std::size_t first, std::size_t last) {
        Group group;
        const auto look_at = [&](const Vec3d& position, const Source& source) {
            group.add(position, source);
            if (group.size < kMostInGroup) return;
            f(group, first / kLeaves);
            group.size = 0;
        };
        for (std::size_t l = first; l < last; ++l) {
            const BoxTree::Leaf& leaf = leaves[l];
            // Triangles that are near each other may be anywhere in the mesh.
            if (l + kAhead < last)
                for (const std::uint32_t t : leaves[l + kAhead].triangle) from.prefetch(t);
            for (std::size_t i = 0; i < leaf.count; ++i) {
                const std::uint32_t t = leaf.triangle[i];
                const TriangleCorners corners{to_double(leaf.corner(0, i)), to_double(leaf.corner(1, i)),
                                              to_double(leaf.corner(2, i))};
                for (std::size_t k = from.first_sample(t); k < from.first_sample(t + std::size_t{1}); ++k) {
                    if (wanted.sample(k))
                        look_at(spread_position(corners, static_cast<double>(k)), {t, Source::kSample, k});
                }
                if (!wanted.points(t)) continue;
                for (std::uint8_t c = 0; c < 3; ++c) {
                    if (from.owns_corner(t, c)) look_at(corners[c], {t, c, 0});
                }
            }
        }
        if (group.size > 0) f(group, first / kLeaves);
    });
}

// Lists positions that are too far, in the same order for any number of threads.
class FurtherPositions {
  public:
    explicit FurtherPositions(const SampledMesh& from)
        : mesh_(from.mesh()), lists_(from.tree().leaves().size() / kLeaves + 1) {}

    void add(std::size_t range, const Source& source) {
        const Triangle& t = mesh_.triangles[source.triangle];
        if (source.corner == Source::kSample)
            lists_[range].push_back(t);
        else
            lists_[range].push_back({t[source.corner], t[source.corner], t[source.corner]});
    }

    std::vector<Triangle> all() const {
        std::vector<Triangle> result;
        for (const std::vector<Triangle>& list : lists_)
            result.insert(result.end(), list.begin(), list.end());
        return result;
    }

  private:
    const MeshView mesh_;
    std::vector<std::vector<Triangle>> lists_;  // of each range
};

}  // namespace

namespace internal {

SampledMesh::SampledMesh(const MeshView& mesh, std::int64_t samples) : mesh_(mesh) {
    parallel_invoke([&] { tree_.emplace(mesh); },
                    [&] {
                        spread_samples(samples);
                        assign_points();
                    });
}

// Equal steps along the summed areas of the triangles choose the triangle of each sample.
void SampledMesh::spread_samples(std::int64_t count) {
    const std::size_t triangles = mesh_.triangles.size(),
                      samples = checked_size(static_cast<std::uint64_t>(count), sizeof(double));
    std::vector<double> summed_area;
    summed_area.reserve(triangles);
    double sum = 0;
    for (const Triangle& t : mesh_.triangles) summed_area.push_back(sum += area(corners_of(mesh_, t)));
    positions_.resize(triangles + 1);
    const auto place = [&](std::size_t sample) {
        return (static_cast<double>(sample) + 0.5) / static_cast<double>(count) * sum;
    };
    std::size_t k = 0;
    double next = place(k);
    for (std::size_t t = 0; t < triangles; ++t) {
        positions_[t] = {k, 0};
        while (k < samples && (next < summed_area[t] || t + 1 == triangles)) next = place(++k);
    }
    positions_[triangles] = {k, 0};
}

void SampledMesh::assign_points() {
    std::vector<bool> used(mesh_.points.size(), false);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t p = mesh_.triangles[t][c];
            if (used[p]) continue;
            used[p] = true;
            positions_[t].owned |= std::uint64_t{1} << c;
        }
    }
}

// The positions that are to be measured.
struct Distances::Wanted {
    bool all = true;
    std::vector<bool> samples = {}, points_of = {};  // points by their triangle

    bool sample(std::size_t k) const { return all || samples[k]; }
    bool points(std::uint32_t t) const { return all || points_of[t]; }
};

// Keeps what has not changed. A point that is nearer than a sample that is kept does not matter.
Distances::Wanted Distances::find_wanted(const SampledMesh& from, const Changing& changing,
                                         double max_distance) {
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    const std::size_t triangles = from.mesh().triangles.size();
    Wanted wanted{false, std::vector<bool>(from.sample_count()), std::vector<bool>(triangles)};
    of_samples_.resize(from.sample_count());
    names_.resize(from.sample_count(), kNone);
    of_points_.resize(changing.stale.size());
    max_ = 0;
    const auto name = [&](std::size_t t) {
        return changing.names.empty() ? static_cast<std::uint32_t>(t) : changing.names[t];
    };
    for (std::size_t t = 0; t < triangles; ++t) {
        for (std::size_t k = from.first_sample(t); k < from.first_sample(t + 1); ++k) {
            const bool is_kept =
                names_[k] == name(t) && !changing.stale[name(t)] && of_samples_[k] <= max_distance;
            names_[k] = name(t);
            wanted.samples[k] = !is_kept;
            if (is_kept) max_ = std::max(max_, of_samples_[k]);
        }
    }
    for (std::size_t t = 0; t < triangles; ++t) {
        wanted.points_of[t] = changing.stale[name(t)] || of_points_[name(t)] > max_;
        if (wanted.points_of[t]) of_points_[name(t)] = 0;
    }
    return wanted;
}

// Calls f(range, source, distance) for each position, where the distance of a point may be larger than it is
// unless the point is the furthest.
template <class F>
void Distances::measure_positions(const SampledMesh& from, const Wanted& wanted, const TriangleTree& to,
                                  double max_distance, const Progress& progress, double begin, double end,
                                  const F& f) {
    // A point that is nearer than the furthest position so far does not change the maximum.
    std::atomic<double> furthest = max_;
    const auto raise = [&](double distance) {
        double known = furthest.load(std::memory_order_relaxed);
        while (distance > known &&
               !furthest.compare_exchange_weak(known, distance, std::memory_order_relaxed)) {
        }
    };
    for_each_group(from, wanted, progress, begin, end, [&](Group& group, std::size_t range) {
        const double enough = std::min(furthest.load(std::memory_order_relaxed), max_distance);
        for (std::size_t i = 0; i < group.size; ++i)
            group.queries[i].enough = group.sources[i].corner == Source::kSample ? 0 : enough;
        if (group.reach == 0) group.reach = 2 * to.distance(group.queries[0].position);
        to.find_nearest(group.all(), group.reach);
        double reached = 0;
        for (std::size_t i = 0; i < group.size; ++i) {
            const double distance = std::sqrt(group.queries[i].squared_distance);
            if (group.sources[i].corner == Source::kSample)
                reached = std::max(reached, of_samples_[group.sources[i].sample] = distance);
            else
                raise(distance);
            f(range, group.sources[i], distance);
        }
        raise(reached);
        if (reached > 0) group.reach = 2 * reached;
    });
    max_ = furthest;
}

void Distances::measure(const SampledMesh& from, const TriangleTree& to, const Progress& progress,
                        double begin, double end) {
    of_samples_.resize(from.sample_count());
    measure_positions(from, {}, to, std::numeric_limits<double>::infinity(), progress, begin, end,
                      [](std::size_t, const Source&, double) {});
}

std::vector<Triangle> Distances::measure_again(const SampledMesh& from, const Changing& changing,
                                               const TriangleTree& to, double max_distance,
                                               const Progress& progress, double begin, double end) {
    const Wanted wanted = find_wanted(from, changing, max_distance);
    FurtherPositions further(from);
    measure_positions(from, wanted, to, max_distance, progress, begin, end,
                      [&](std::size_t range, const Source& source, double distance) {
                          if (distance > max_distance) further.add(range, source);
                          if (source.corner == Source::kSample) return;
                          const std::uint32_t t = source.triangle;
                          double& of_points = of_points_[changing.names.empty() ? t : changing.names[t]];
                          of_points = std::max(of_points, distance);
                      });
    return further.all();
}

void Distances::reserve(std::int64_t samples) {
    try {
        of_samples_.reserve(checked_size(static_cast<std::uint64_t>(samples), sizeof(double)));
    } catch (const std::bad_alloc&) {
        throw LimitError("mesh distance: " + std::to_string(samples) + " samples do not fit into memory");
    }
}

double Distances::mean() const {
    return std::accumulate(of_samples_.begin(), of_samples_.end(), 0.0) /
           static_cast<double>(of_samples_.size());
}

MeshDistance symmetric(const Distances& there, const Distances& back) {
    return {(there.mean() + back.mean()) / 2, std::max(there.max(), back.max())};
}

}  // namespace internal

MeshDistance mesh_distance(MeshView a, MeshView b, const DistanceOptions& options) {
    if (options.samples < 1) throw InputError("mesh distance: there must be at least one sample");
    for (const MeshView& mesh : {a, b}) {
        if (mesh.triangles.empty()) throw InputError("mesh distance: a mesh has no triangles");
        check_arrays(mesh);
        check_coordinates(mesh.points);
        check_triangle_count(mesh, "mesh distance");
    }
    Distances there, back;
    for (Distances* const distances : {&there, &back}) distances->reserve(options.samples);
    MeshDistance result;
    with_threads(options.threads, [&] {
        std::optional<SampledMesh> from_a, from_b;
        parallel_invoke([&] { from_a.emplace(a, options.samples); },
                        [&] { from_b.emplace(b, options.samples); });
        there.measure(*from_a, from_b->tree(), options.progress, 0, 0.5);
        back.measure(*from_b, from_a->tree(), options.progress, 0.5, 1);
        result = symmetric(there, back);
    });
    return result;
}

}  // namespace marrow
