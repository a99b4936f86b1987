// Half-edge collapse with a bucket queue. How it is set up, how collapses are undone, and how the result is
// written is in edge_collapse_set_up.cpp, edge_collapse_undo.cpp and edge_collapse_result.cpp.
#include "edge_collapse.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

namespace marrow::internal {

namespace {

// The sum of squared distances at an end of an edge may be this many times the least sum.
constexpr double kMostIncrease = 30;

// While regions have this many triangles on average, they are worth a thread.
constexpr std::size_t kFewTriangles = 1024;

constexpr std::size_t kPerOctave = 8;  // buckets

std::uint32_t bucket_of(float cost) {
    constexpr int kMantissaBits = 23;
    return std::bit_cast<std::uint32_t>(cost) >> (kMantissaBits - std::countr_zero(kPerOctave));
}

}  // namespace

EdgeCollapse::Region::Region(std::uint16_t n)
    : number(n), buckets(bucket_of(std::numeric_limits<float>::infinity()) + 1), lowest(buckets.size()) {}

// The sum of the quadrics of two points, relative to point a.
HWY_INLINE Quadric<double> EdgeCollapse::merged_quadric(std::uint32_t a, std::uint32_t b) const {
    Quadric<double> merged = Quadric<double>(points_[b].quadric).relative_to(position(a) - position(b));
    merged += Quadric<double>(points_[a].quadric);
    return merged;
}

void EdgeCollapse::add_to(CollapseBatch& batch, Half h) const {
    const Point &a = points_[from(h)], &b = points_[to(h)];
    batch.add(a.position, a.quadric, b.position, b.quadric);
}

CollapseTarget EdgeCollapse::target(Half h) const {
    CollapseBatch batch;
    add_to(batch, h);
    batch.evaluate();
    return batch[0];
}

EdgeCollapse::Region& EdgeCollapse::region_of(Half h) {
    const std::uint16_t at_begin = points_[from(h)].region, at_end = points_[to(h)].region;
    return regions_[divided_ && at_begin == at_end ? at_begin : 0];
}

// Moves the entries of another region to this one.
void EdgeCollapse::Region::take(Region& other) {
    lowest = std::min(lowest, other.lowest);
    for (; other.lowest < buckets.size(); ++other.lowest) {
        Bucket& bucket = other.buckets[other.lowest];
        std::vector<Entry>& entries = buckets[other.lowest].entries;
        entries.insert(entries.end(), bucket.entries.begin() + static_cast<std::ptrdiff_t>(bucket.first),
                       bucket.entries.end());
        bucket = {};
    }
}

bool EdgeCollapse::has_queued() const {
    return std::any_of(regions_.begin(), regions_.end(),
                       [](const Region& region) { return region.lowest < region.buckets.size(); });
}

void EdgeCollapse::queue(Region& region, Half h, std::size_t bucket) {
    append(region, {h, version(h)}, bucket);
    faces_[h / 4].queued |= 1u << h % 4;
}

void EdgeCollapse::append(Region& region, Entry entry, std::size_t bucket) {
    region.buckets[bucket].entries.push_back(entry);
    region.lowest = std::min(region.lowest, bucket);
}

void EdgeCollapse::queue_all() {
    struct Cost {
        Entry entry;
        std::uint32_t bucket;
    };
    // Each range of triangles lists the edges of each region.
    constexpr std::size_t kRange = 16384;
    const std::size_t ranges = (faces_.size() + kRange - 1) / kRange;
    std::vector<std::vector<std::vector<Cost>>> costs(ranges);
    parallel_for(std::size_t{0}, ranges, [&](std::size_t range) {
        costs[range].resize(regions_.size());
        CollapseBatch batch;
        std::array<Half, CollapseBatch::kMost> edges;
        const auto list_batch = [&] {
            batch.evaluate();
            for (std::size_t i = 0; i < batch.size(); ++i) {
                const Half h = edges[i];
                if (!is_allowed(batch[i])) continue;
                costs[range][region_of(h).number].push_back({{h, version(h)}, bucket_of(batch[i].cost)});
                faces_[h / 4].queued |= 1u << h % 4;
            }
            batch.clear();
        };
        const std::size_t end = std::min((range + 1) * kRange, faces_.size());
        for (auto t = static_cast<Half>(range * kRange); t < end; ++t) {
            for (Half h = 4 * t; h < 4 * t + 3; ++h) {
                const bool wanted = is_alive(h) && twin(h) != kNone && h < twin(h) && !is_fixed(h) &&
                                    (points_[from(h)].changed || points_[to(h)].changed);
                if (!wanted) continue;
                edges[batch.size()] = h;
                add_to(batch, h);
                if (batch.size() == CollapseBatch::kMost) list_batch();
            }
        }
        list_batch();
    });
    parallel_for(std::size_t{0}, regions_.size(), [&](std::size_t r) {
        for (const auto& range : costs) {
            for (const Cost& edge : range[r]) append(regions_[r], edge.entry, edge.bucket);
        }
    });
    parallel_for_ranges(std::size_t{0}, points_.size(), 4096, [&](const auto& range) {
        for (std::size_t p = range.begin(); p < range.end(); ++p) points_[p].changed = false;
    });
}

// Evaluates the next entries of a bucket together, and fetches what the next calls and the collapses need:
// their triangles and points are scattered over the memory.
//
// Everything here must be inlined: GCC treats a function that only prefetches as free of effects and removes
// calls of it. So the lambdas return addresses.
HWY_INLINE void EdgeCollapse::evaluate(const Bucket& bucket, Evaluated& evaluated) const {
    constexpr std::size_t kMost = CollapseBatch::kMost;
    const std::vector<Entry>& entries = bucket.entries;
    const auto end_of = [&](std::size_t calls) {
        return std::min(bucket.first + calls * kMost, entries.size());
    };
    for (std::size_t i = end_of(2); i < end_of(3); ++i) hwy::Prefetch(&faces_[entries[i].half / 4]);
    for (std::size_t i = end_of(1); i < end_of(2); ++i) {
        const Half h = entries[i].half;
        if (!is_alive(h)) continue;
        hwy::Prefetch(&faces_[twin(h) / 4]);
        for (const std::uint32_t p : {from(h), to(h)}) hwy::Prefetch(&points_[p]);
    }
    evaluated.batch.clear();
    evaluated.begin = bucket.first;
    evaluated.end = end_of(1);
    std::array<Half, 2 * kMost> sides;  // of the edges that are probably collapsed
    std::size_t side_count = 0;
    for (std::size_t i = evaluated.begin; i < evaluated.end; ++i) {
        const Half h = entries[i].half;
        std::uint8_t& place = evaluated.place[i - evaluated.begin];
        place = Evaluated::kNowhere;
        if (!may_collapse(h)) continue;
        place = static_cast<std::uint8_t>(evaluated.batch.size());
        evaluated.ends[place] = ends(h);
        add_to(evaluated.batch, h);
        if (version(h) != entries[i].version) continue;
        sides[side_count++] = h;
        sides[side_count++] = twin(h);
    }
    const std::span<const Half> wanted(sides.data(), side_count);
    const auto face = [&](Half h) { return &faces_[h / 4]; };
    const auto apex = [&](Half h) { return &points_[from(prev(h))]; };
    // The next triangle around the end and around the beginning.
    const auto at_end = [&](Half h) { return twin(next(h)); };
    const auto at_begin = [&](Half h) { return twin(prev(h)); };
    for (const Half side : wanted) {
        hwy::Prefetch(apex(side));
        hwy::Prefetch(face(at_end(side)));
        hwy::Prefetch(face(at_begin(side)));
    }
    evaluated.batch.evaluate();
    for (const Half side : wanted) {
        const Half end = at_end(side), begin = at_begin(side);
        hwy::Prefetch(apex(end));
        hwy::Prefetch(apex(begin));
        hwy::Prefetch(face(at_end(end)));
        hwy::Prefetch(face(at_begin(begin)));
    }
    for (const Half side : wanted) {
        hwy::Prefetch(apex(at_end(at_end(side))));
        hwy::Prefetch(apex(at_begin(at_begin(side))));
    }
}

// Finds the region's edge with the least cost. False if no bucket before `end` has one. If an end has
// changed since the edge was queued, its cost is computed again, and the edge is mostly queued again with a
// larger cost.
bool EdgeCollapse::pop(Region& region, std::size_t end, Evaluated& evaluated, Due& due) {
    for (; region.lowest < end; ++region.lowest) {
        Bucket& bucket = region.buckets[region.lowest];
        while (bucket.first < bucket.entries.size()) {
            if (evaluated.bucket != region.lowest || bucket.first < evaluated.begin ||
                bucket.first >= evaluated.end) {
                evaluated.bucket = region.lowest;
                evaluate(bucket, evaluated);
            }
            const std::uint8_t place = evaluated.place[bucket.first - evaluated.begin];
            const auto [h, version_then] = bucket.entries[bucket.first++];
            faces_[h / 4].queued &= ~(1u << h % 4);
            if (!may_collapse(h)) continue;
            const bool is_evaluated = place != Evaluated::kNowhere && evaluated.ends[place] == ends(h);
            due = {h, is_evaluated ? evaluated.batch[place] : target(h)};
            if (version(h) == version_then) return true;
            if (!is_allowed(due.target)) continue;
            const std::size_t new_bucket = bucket_of(due.target.cost);
            if (new_bucket <= region.lowest) return true;
            queue(region, h, new_bucket);
        }
        bucket = {};
        evaluated.end = 0;
    }
    return false;
}

// Finds the neighbours of the point at the beginning of a half-edge, the point at its end first. False if
// there are too many.
bool EdgeCollapse::find_ring(Half first, Ring& ring) const {
    ring.size = 0;
    Half h = first;
    do {
        if (ring.size == Ring::kMost) return false;
        ring.set(ring.size++, to(h), points_[to(h)].position);
        h = twin(prev(h));
    } while (h != first);
    ring.set(ring.size, to(first), points_[to(first)].position);
    return true;
}

// Whether no other thread changes triangles around the ends of the edge, nor their other neighbours.
bool EdgeCollapse::is_inside(const Region& region) const {
    if (region.number == 0) return true;
    const auto is_of_region = [&](std::uint32_t p) { return points_[p].region == region.number; };
    const auto is_inside = [&](const Ring& ring) {
        return std::all_of(ring.points, ring.points + ring.size, is_of_region);
    };
    return is_inside(region.from_ring) && is_inside(region.to_ring);
}

// The link condition: the one-rings of the ends of h share exactly the two points opposite to h. These points
// must also keep at least three triangles each.
bool EdgeCollapse::meets_link_condition(Half h, const Region& region) const {
    if (count_shared(region.from_ring, region.to_ring) != 2) return false;
    for (const Half towards : {next(h), next(twin(h))}) {
        const std::uint32_t opposite = to(towards);
        if (!points_[opposite].open && has_few_triangles(opposite)) return false;
    }
    return true;
}

// Whether a point has three triangles or fewer. \pre the point is not open
bool EdgeCollapse::has_few_triangles(std::uint32_t point) const {
    if (points_[point].degree != kHighDegree) return points_[point].degree <= 3;
    const Half first = points_[point].outgoing;
    Half out = first;
    for (int triangles = 1; triangles <= 3; ++triangles) {
        out = twin(prev(out));
        if (out == first) return true;
    }
    return false;
}

// Whether the collapse would turn a small component inside out: no triangle need flip if the point goes to
// the other side of those opposite to it. Looks only at components without handles whose points are all in
// the rings of the edge, which belong to the region. Larger ones hardly ever turn, as they would pass through
// themselves.
bool EdgeCollapse::inverts_component(Half h, const Vec3d& there, Region& region) const {
    // The degrees of such a component tell, and are at hand: those of v points add up to 6 v - 12.
    std::size_t degrees = 0;
    for (const Ring* ring : {&region.from_ring, &region.to_ring}) {
        for (std::size_t k = 0; k < ring->size; ++k) degrees += points_[ring->points[k]].degree;
    }
    for (const Half towards : {next(h), next(twin(h))}) degrees -= points_[to(towards)].degree;
    const std::size_t points = region.from_ring.size + region.to_ring.size - 2;
    if (degrees != 6 * points - 12) return false;
    const std::uint32_t ends[2] = {from(h), to(h)};
    const auto is_in = [](std::uint32_t p, const Ring& ring) {
        return std::find(ring.points, ring.points + ring.size, p) != ring.points + ring.size;
    };
    std::vector<Half>& opposite = region.opposite;  // the triangles that are not at the ends, by an edge
    opposite.clear();
    // False if the triangle on this side of an edge has another point.
    const auto add = [&](Half edge) {
        if (edge == kNone) return false;
        const std::uint32_t apex = from(prev(edge));
        if (!is_in(apex, region.from_ring) && !is_in(apex, region.to_ring)) return false;
        const auto is_same = [&](Half other) { return other / 4 == edge / 4; };
        const bool is_at_end = std::any_of(std::begin(ends), std::end(ends), [&](std::uint32_t end) {
            return apex == end || from(edge) == end || to(edge) == end;
        });
        if (!is_at_end && std::none_of(opposite.begin(), opposite.end(), is_same)) opposite.push_back(edge);
        return true;
    };
    for (const Half first : {h, twin(h)}) {
        Half out = first;
        do {
            if (!add(twin(next(out)))) return false;
            out = twin(prev(out));
        } while (out != first);
    }
    for (std::size_t i = 0; i < opposite.size(); ++i) {
        if (!add(twin(next(opposite[i]))) || !add(twin(prev(opposite[i])))) return false;
    }
    const auto volume = [&](const Vec3d& origin, Half edge) {
        return dot(position(from(edge)) - origin,
                   cross(position(to(edge)) - origin, position(from(prev(edge))) - origin));
    };
    // Relative to the point at one end, the triangles there have no volume.
    const Vec3d here = position(ends[0]);
    double before = 0, after = 0;
    for_each_outgoing(ends[1], [&](Half out) { before += volume(here, out); });
    for (const Half edge : opposite) before += volume(here, edge), after += volume(there, edge);
    return (before > 0) != (after > 0) || (before < 0) != (after < 0);
}

bool EdgeCollapse::guard_accepts(Half h, const Vec3d& there, std::vector<PatchTriangle>& patch) {
    patch.clear();
    const std::uint32_t removed[2] = {h / 4, twin(h) / 4};
    for (const std::uint32_t end : {from(h), to(h)}) {
        for_each_outgoing(end, [&](Half out) {
            if (out / 4 == removed[0] || out / 4 == removed[1]) return;
            const std::uint32_t i = to(out), j = from(prev(out));
            patch.push_back({out / 4, {from(h), i, j}, {there, position(i), position(j)}});
        });
    }
    return guard_->accept(removed, patch);
}

// Merges the end of h into its beginning, at the position with the least cost or at the better end. False if
// no position is acceptable, or if the edge is left for later because it is at the border of the region.
bool EdgeCollapse::collapse(const Due& due, Region& region) {
    const Half h = due.half, g = twin(h);
    const std::uint32_t a = from(h), b = to(h);
    Ring &from_ring = region.from_ring, &to_ring = region.to_ring;
    if (!find_ring(h, from_ring) || !find_ring(g, to_ring) || from_ring.size + to_ring.size > Ring::kMost)
        return false;
    if (!is_inside(region)) {
        faces_[h / 4].queued |= 1u << h % 4;
        region.outside.push_back({region.lowest, {h, version(h)}});
        return false;
    }
    CollapseTarget there = due.target;
    if (!meets_link_condition(h, region) || !is_allowed(there)) return false;
    const auto keeps = [&](const Vec3f& p) {
        return keeps_shape(from_ring, position(a), to_double(p)) &&
               keeps_shape(to_ring, position(b), to_double(p));
    };
    const Quadric<double> merged = merged_quadric(a, b);
    if (!keeps(there.position)) {
        const double least = there.sum, at_a = merged.c, at_b = merged(position(b) - position(a));
        there.position = points_[at_a <= at_b ? a : b].position;
        there.sum = std::min(at_a, at_b);
        if (there.sum > kMostIncrease * least || !is_allowed(there) || !keeps(there.position)) return false;
    }
    if (inverts_component(h, to_double(there.position), region)) return false;
    if (guard_ && !guard_accepts(h, to_double(there.position), region.patch)) return false;
    for_each_outgoing(b, [&](Half out) { faces_[out / 4].from[out % 4] = a; });
    // Removes the two triangles along h. Each had an edge to a and an edge to b, which become one edge.
    const auto close = [&](Half left, Half right) {
        const Half l = twin(left), r = twin(right);
        pair(l, r);
        points_[from(l)].outgoing = l;
        points_[from(r)].outgoing = r;
    };
    close(next(h), prev(h));
    close(next(g), prev(g));
    for (const Half removed : {h, g}) {
        faces_[removed / 4].alive = false;
        std::uint8_t& degree = points_[from(prev(removed))].degree;
        if (degree != kHighDegree) --degree;
    }

    Point& kept = points_[a];
    region.log.push_back({h, b, ++region.time, kept});
    kept.quadric = Quadric<float>(merged.relative_to(to_double(there.position) - position(a)));
    kept.position = there.position;
    kept.latest = region.first_collapse + static_cast<std::uint32_t>(region.log.size() - 1);
    kept.is_new = true;
    kept.degree = static_cast<std::uint8_t>(from_ring.size + to_ring.size - 4);
    if (points_[b].region != kept.region) kept.region = 0;
    points_[b].outgoing = kNone;
    return true;
}

// Queues the edges around a point that has moved.
void EdgeCollapse::queue_around(std::uint32_t point, Region& region) {
    points_[point].changed = true;
    for_each_outgoing(point, [&](Half out) {
        points_[to(out)].changed = true;
        const Half edge = std::min(out, twin(out));
        if (is_queued(edge) || is_fixed(edge)) return;
        const CollapseTarget there = target(edge);
        if (is_allowed(there))
            queue(region.number == 0 ? region_of(edge) : region, edge, bucket_of(there.cost));
    });
}

// Collapses up to `most` of the region's edges, cheapest first, from the buckets before `end`.
// Returns how many it collapsed.
std::size_t EdgeCollapse::collapse_up_to(std::size_t most, std::size_t end, Region& region, Stage& stage) {
    std::size_t collapsed = 0, reported = 0;
    Evaluated evaluated;
    Due due;
    for (std::size_t tried = 1; collapsed < most && pop(region, end, evaluated, due); ++tried) {
        const std::uint32_t kept = from(due.half);
        if (collapse(due, region)) {
            ++collapsed;
            queue_around(kept, region);
        }
        if (tried % 8192 == 0)
            stage.step(static_cast<double>(collapsed - std::exchange(reported, collapsed)));
    }
    stage.step(static_cast<double>(collapsed - reported));
    return collapsed;
}

void EdgeCollapse::set_guard(CollapseGuard* guard) {
    guard_ = guard;
    parallel_ = false;
    for (Point& point : points_) {
        if (!point.fixed || point.open) continue;
        point.fixed = false;
        point.changed = true;
    }
}

void EdgeCollapse::reduce_to(std::size_t triangles, const Progress& progress) {
    if (alive_ <= triangles) return;
    Stage stage(progress, 0, 1, (alive_ - triangles + 1) / 2);
    // Queues all edges again while this helps: a rejected collapse may become acceptable after its
    // neighbourhood changed. What is left in the queue after the last call comes first.
    for (std::size_t before = 2 * alive_; alive_ > triangles && alive_ < 0.99 * before;) {
        before = alive_;
        divided_ = parallel_;
        if (!has_queued()) queue_all();
        if (parallel_) collapse_regions(triangles, stage);
        if (alive_ > triangles)
            alive_ -= 2 * collapse_up_to((alive_ - triangles + 1) / 2, regions_[0].buckets.size(),
                                         regions_[0], stage);
    }
}

// Collapses the inner edges of all regions at the same time, cheapest first, and those between regions in
// turn, until few are left to collapse. The shared cost rises bucket by bucket; at first by octaves, as
// the order matters little between edges that all go in the end.
void EdgeCollapse::collapse_regions(std::size_t triangles, Stage& stage) {
    const std::size_t few = std::max(faces_.size() / 64, 16 * regions_.size());
    std::vector<std::size_t> queued(regions_.size()), collapsed(regions_.size());
    const std::size_t half = triangles + (alive_ - triangles) / 2;
    while (has_queued() && alive_ > std::max(triangles + few, kFewTriangles * regions_.size())) {
        std::size_t lowest = regions_[0].lowest;
        for (const Region& region : regions_) lowest = std::min(lowest, region.lowest);
        const std::size_t end =
            std::min(lowest + (alive_ > half ? kPerOctave : 1), regions_[0].buckets.size());
        for (std::size_t r = 0; r < regions_.size(); ++r) {
            queued[r] = 0;
            for (std::size_t b = lowest; b < end; ++b) queued[r] += regions_[r].buckets[b].left();
            regions_[r].time = regions_[0].time;
        }
        // Each region gets a share of half of the collapses that are left, so that all stop at about the same
        // cost. A few more, as each may do at least one, are still fewer than all.
        const std::size_t all = std::accumulate(queued.begin(), queued.end(), std::size_t{1}),
                          wanted = (alive_ - triangles) / 4;
        parallel_for(std::size_t{1}, regions_.size(), [&](std::size_t r) {
            collapsed[r] = collapse_up_to(1 + wanted * queued[r] / all, end, regions_[r], stage);
        });
        Region& between = regions_[0];
        for (std::size_t r = 1; r < regions_.size(); ++r) {
            alive_ -= 2 * collapsed[r];
            for (const auto& [bucket, entry] : regions_[r].outside) append(between, entry, bucket);
            regions_[r].outside.clear();
            between.time = std::max(between.time, regions_[r].time);
        }
        alive_ -= 2 * collapse_up_to((alive_ - triangles) / 4, end, between, stage);
    }
    // One thread goes on with all edges.
    for (std::size_t r = 1; r < regions_.size(); ++r) regions_[0].take(regions_[r]);
    divided_ = false;
}

}  // namespace marrow::internal
