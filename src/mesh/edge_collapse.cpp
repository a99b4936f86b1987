#include "edge_collapse.h"

#include <tbb/parallel_for.h>

#include <hwy/cache_control.h>

#include <bit>
#include <numeric>

#include "base/progress.h"

namespace marrow::internal {

namespace {

constexpr double kPull = 1e-5;  // of a plane's weight: keeps points of flat parts where they are
// A triangle's height over its longest edge: below this a collapse must not make it worse.
constexpr double kThin = 0.05;
constexpr double kTurn = 0.2;  // the least cosine between a triangle's normals before and after

constexpr double kSecondBest = 9;  // how much more than its best an edge's error may be, squared

std::size_t bucket_of(float error) {
    return std::bit_cast<std::uint32_t>(error) >> 21;  // four buckets an octave
}

}  // namespace

EdgeCollapse::EdgeCollapse(const Mesh& mesh, double max_error, DeviationGuard* guard)
    : max_squared_error_(max_error * max_error),
      guard_(guard),
      alive_(mesh.triangles.size()),
      buckets_(bucket_of(std::numeric_limits<float>::infinity()) + 1) {
    if (!mesh.points.empty()) origin_ = to_double(mesh.points.front());
    points_.reserve(mesh.points.size());
    for (const Vec3f& p : mesh.points) points_.push_back({.place = to_double(p) - origin_, .quadric = {}});
    faces_.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) faces_.push_back({t, {kNone, kNone, kNone}});
    pair_half_edges();
    fix_points();
    sum_quadrics();
}

// Finds each half-edge's twin in the triangle beside it: kNone along open and non-manifold edges.
void EdgeCollapse::pair_half_edges() {
    struct Seen {  // from its lower point
        std::uint32_t higher;
        Half half;
    };
    std::vector<std::size_t> start(points_.size() + 2, 0);
    const auto for_each_half = [&](auto f) {
        for (Half t = 0; t < faces_.size(); ++t) {
            for (Half h = 4 * t; h < 4 * t + 3; ++h) f(std::min(from(h), to(h)), std::max(from(h), to(h)), h);
        }
    };
    // Counted two slots on, so that filling leaves start[p] at the begin of p's bucket.
    for_each_half([&](std::uint32_t lower, std::uint32_t, Half) { ++start[lower + std::size_t{2}]; });
    std::partial_sum(start.begin(), start.end(), start.begin());
    Buffer<Seen> sorted(3 * faces_.size());
    for_each_half([&](std::uint32_t lower, std::uint32_t higher, Half h) {
        sorted[start[lower + std::size_t{1}]++] = {higher, h};
    });
    for (std::size_t p = 0; p < points_.size(); ++p) {
        const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(start[p]);
        const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(start[p + 1]);
        std::sort(begin, end, [](const Seen& a, const Seen& b) { return a.higher < b.higher; });
        for (auto at = begin; at != end;) {
            auto after = at;
            while (after != end && after->higher == at->higher) ++after;
            if (after - at == 2 && from(at[0].half) != from(at[1].half)) pair(at[0].half, at[1].half);
            at = after;
        }
    }
}

// Those that have a half-edge without a twin, and those whose triangles are not one fan round them.
void EdgeCollapse::fix_points() {
    std::vector<std::uint32_t> triangles_at(points_.size(), 0);
    for (Half t = 0; t < faces_.size(); ++t) {
        for (Half h = 4 * t; h < 4 * t + 3; ++h) {
            points_[from(h)].outgoing = h;
            ++triangles_at[from(h)];
            if (twin(h) == kNone) points_[from(h)].fixed = points_[to(h)].fixed = true;
        }
    }
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
        Point& point = points_[p];
        if (point.outgoing == kNone) point.fixed = true;
        if (point.fixed) continue;
        std::uint32_t in_fan = 0;
        for_each_outgoing(p, [&](Half) { ++in_fan; });
        point.fixed = in_fan != triangles_at[p];
    }
}

void EdgeCollapse::sum_quadrics() {
    for (const Face& face : faces_) {
        Point* const corners[3] = {&points_[face.from[0]], &points_[face.from[1]], &points_[face.from[2]]};
        const Vec3d& a = corners[0]->place;
        const Vec3d normal = cross(corners[1]->place - a, corners[2]->place - a);
        const double twice_area = length(normal);
        if (twice_area == 0) continue;
        for (Point* const p : corners) {
            p->quadric.add_plane((1 / twice_area) * normal, a, twice_area / 6);
            p->quadric.add_place(p->place, kPull * twice_area / 6);
        }
    }
}

// \pre `point` is not fixed
template <class F>
void EdgeCollapse::for_each_outgoing(std::uint32_t point, F f) const {
    const Half first = points_[point].outgoing;
    Half h = first;
    do {
        f(h);
        h = twin(prev(h));
    } while (h != first);
}

EdgeCollapse::Target EdgeCollapse::target(Half h) const {
    const Point &a = points_[from(h)], &b = points_[to(h)];
    const Vec3d middle = 0.5 * (a.place + b.place), along = b.place - a.place;
    Quadric q = a.quadric;
    q += b.quadric;
    Vec3d place = q.least().value_or(middle);
    // Far off, the planes are all but parallel to some line, and rounding errors decide.
    if (const Vec3d off = place - middle; dot(off, off) > 4 * dot(along, along)) place = middle;
    return {place, static_cast<float>(q.mean(place))};
}

void EdgeCollapse::queue(Half h, float error) {
    if (!(error <= max_squared_error_)) return;
    const std::size_t bucket = bucket_of(error);
    buckets_[bucket].entries.push_back({h, version(h)});
    faces_[h / 4].queued |= std::uint64_t{1} << h % 4;
    lowest_ = std::min(lowest_, bucket);
}

void EdgeCollapse::queue_all() {
    constexpr float kUnasked = -1;
    Buffer<std::array<float, 3>> errors(faces_.size());
    tbb::parallel_for(
        tbb::blocked_range<Half>(0, static_cast<Half>(faces_.size()), 4096), [&](const auto& range) {
            for (Half t = range.begin(); t < range.end(); ++t) {
                for (Half h = 4 * t; h < 4 * t + 3; ++h) {
                    const bool asked = is_alive(h) && twin(h) != kNone && h < twin(h) && !is_fixed(h) &&
                                       (points_[from(h)].changed || points_[to(h)].changed);
                    errors[t][h % 4] = asked ? target(h).error : kUnasked;
                }
            }
        });
    for (Half t = 0; t < faces_.size(); ++t) {
        for (Half k = 0; k < 3; ++k) {
            if (errors[t][k] != kUnasked) queue(4 * t + k, errors[t][k]);
        }
    }
    for (Point& point : points_) point.changed = false;
}

// The half-edge of the edge with the least error; kNone where there is none. Where an end has changed since an edge was
// queued, it is only now that its error is found again: mostly it has grown.
EdgeCollapse::Half EdgeCollapse::pop() {
    for (; lowest_ < buckets_.size(); ++lowest_) {
        Bucket& bucket = buckets_[lowest_];
        if (bucket.first == 0) sort_by_place(bucket.entries);
        while (bucket.first < bucket.entries.size()) {
            fetch_soon(bucket);
            const auto [h, version_then] = bucket.entries[bucket.first++];
            faces_[h / 4].queued &= ~(std::uint64_t{1} << h % 4);
            if (!is_alive(h) || h > twin(h)) continue;
            if (version(h) == version_then) return h;
            const float error = target(h).error;
            if (error <= max_squared_error_ && bucket_of(error) <= lowest_) return h;
            queue(h, error);
        }
        bucket = {};
    }
    return kNone;
}

// Roughly in the order that triangles have, so that what is read lies where something was read just before.
void EdgeCollapse::sort_by_place(std::vector<Entry>& entries) {
    constexpr std::size_t kShares = 4096;
    if (entries.size() < kShares) return;
    const std::size_t share = 4 * faces_.size() / kShares + 1;
    std::array<std::size_t, kShares + 1> start{};
    for (const Entry& e : entries) ++start[e.half / share + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    sorted_.resize(entries.size());
    for (const Entry& e : entries) sorted_[start[e.half / share]++] = e;
    std::copy(sorted_.begin(), sorted_.end(), entries.begin());
}

// What the next entries name lies all over the memory: step by step, each from what the one before has fetched, asks
// for the triangles and points round their edges.
void EdgeCollapse::fetch_soon(const Bucket& bucket) const {
    constexpr std::size_t kStep = 5;
    const std::size_t left = bucket.entries.size() - bucket.first;
    const auto entry = [&](std::size_t steps) { return bucket.entries[bucket.first + steps * kStep]; };
    const auto fetch_face = [&](Half h) { hwy::Prefetch(&faces_[h / 4]); };
    const auto fetch_apex = [&](Half h) { hwy::Prefetch(&points_[from(prev(h))]); };
    if (left > 5 * kStep) fetch_face(entry(5).half);
    if (left > 4 * kStep && is_alive(entry(4).half)) {
        const Half h = entry(4).half;
        fetch_face(twin(h));
        for (const std::uint32_t p : {from(h), to(h)}) {
            hwy::Prefetch(&points_[p]);
            hwy::Prefetch(&points_[p].quadric.c);
        }
    }
    for (const std::size_t steps : {3, 2, 1}) {
        if (left <= steps * kStep) continue;
        const auto [h, version_then] = entry(steps);
        if (!is_alive(h) || version(h) != version_then) continue;
        for (const Half side : {h, twin(h)}) {
            // The triangles that follow round the end of `side` and round its beginning.
            Half at_end = twin(next(side)), at_begin = twin(prev(side));
            if (steps == 3) {
                fetch_apex(side);
                fetch_face(at_end);
                fetch_face(at_begin);
                continue;
            }
            if (steps == 1) at_end = twin(next(at_end)), at_begin = twin(prev(at_begin));
            fetch_apex(at_end);
            fetch_apex(at_begin);
            if (steps == 1) continue;
            fetch_face(twin(next(at_end)));
            fetch_face(twin(prev(at_begin)));
        }
    }
}

// False where it has too many points.
bool EdgeCollapse::find_ring(std::uint32_t point, Ring& ring) const {
    ring.size = 0;
    const Half first = points_[point].outgoing;
    Half h = first;
    do {
        if (ring.size == kMostNeighbours) return false;
        ring.points[ring.size++] = to(h);
        h = twin(prev(h));
    } while (h != first);
    return true;
}

void EdgeCollapse::find_normals(std::uint32_t point, Ring& ring) const {
    const Vec3d& place = points_[point].place;
    ring.normal = {};
    for (std::size_t k = 0; k < ring.size; ++k) {
        const Vec3d &u = points_[ring.points[k]].place, &w = points_[ring.points[ring.after(k)]].place;
        ring.normals[k] = cross(u - place, w - place);
        ring.normal = ring.normal + ring.normals[k];
    }
}

// The link condition: the ends of h share exactly the two points opposite to it, and these keep at least three
// triangles each.
bool EdgeCollapse::links_meet_twice(Half h) {
    Ring &a = from_ring_, &b = to_ring_;
    if (!find_ring(from(h), a) || !find_ring(to(h), b) || a.size + b.size > kMostNeighbours) return false;
    const auto end = a.points.begin() + static_cast<std::ptrdiff_t>(a.size);
    int shared = 0;
    for (std::size_t k = 0; k < b.size; ++k) shared += std::find(a.points.begin(), end, b.points[k]) != end;
    if (shared != 2) return false;
    for (const Half towards : {next(h), next(twin(h))}) {
        const std::uint32_t opposite = to(towards);
        if (points_[opposite].fixed) continue;  // if it had only three, its triangles would close round it
        const Half first = points_[opposite].outgoing;
        Half out = first;
        for (int triangles = 1; triangles <= 3; ++triangles) {
            out = twin(prev(out));
            if (out == first) return false;
        }
    }
    return true;
}

// Whether the triangles round `point` that do not have `other` neither turn over nor thin out when it goes to
// `place`. A triangle that is thin already has no normal to speak of: it is asked to face as its fan does.
bool EdgeCollapse::keeps_shape(const Ring& ring, std::uint32_t point, std::uint32_t other,
                               const Vec3d& place) const {
    const Vec3d& old_place = points_[point].place;
    for (std::size_t k = 0; k < ring.size; ++k) {
        const std::uint32_t i = ring.points[k], j = ring.points[ring.after(k)];
        if (i == other || j == other) continue;
        const Vec3d &u = points_[i].place, &w = points_[j].place, &old_normal = ring.normals[k];
        const Vec3d normal = cross(u - place, w - place);
        const double area = dot(normal, normal), old_area = dot(old_normal, old_normal);
        // A triangle is thin where its height is below kThin of its longest edge; all is squared.
        const auto longest = [&](const Vec3d& p) {
            const double edge = std::max({dot(u - p, u - p), dot(w - p, w - p), dot(w - u, w - u)});
            return edge * edge;
        };
        const double edge = longest(place), old_edge = longest(old_place);
        const bool was_thin = !(old_area > kThin * kThin * old_edge);
        const bool is_thinner = edge > 0 ? area * old_edge < old_area * edge : old_area > 0;
        const Vec3d& facing = was_thin ? ring.normal : old_normal;
        const double cosine = dot(facing, normal), sizes = dot(facing, facing) * area;
        const bool turns = sizes > 0 && !(cosine > 0 && cosine * cosine > kTurn * kTurn * sizes);
        const bool thins = !(area > kThin * kThin * edge) && is_thinner;
        if (turns || thins) return false;
    }
    return true;
}

bool EdgeCollapse::guard_accepts(Half h, const Vec3d& place) {
    patch_.clear();
    const std::uint32_t gone[2] = {h / 4, twin(h) / 4};
    for (const std::uint32_t end : {from(h), to(h)}) {
        for_each_outgoing(end, [&](Half out) {
            if (out / 4 == gone[0] || out / 4 == gone[1]) return;
            patch_.push_back({out / 4, origin_ + place, origin_ + points_[to(out)].place,
                              origin_ + points_[from(prev(out))].place});
        });
    }
    return guard_->accept(gone, patch_);
}

// Merges the end of h into its beginning, at the best place or at one of the ends; false where that would do
// harm.
bool EdgeCollapse::collapse(Half h) {
    const std::uint32_t a = from(h), b = to(h);
    if (!links_meet_twice(h)) return false;
    find_normals(a, from_ring_);
    find_normals(b, to_ring_);
    const auto keeps = [&](const Vec3d& p) {
        return keeps_shape(from_ring_, a, b, p) && keeps_shape(to_ring_, b, a, p);
    };
    auto [place, error] = target(h);
    if (!keeps(place)) {
        Quadric q = points_[a].quadric;
        q += points_[b].quadric;
        const bool a_is_better = q.mean(points_[a].place) <= q.mean(points_[b].place);
        place = points_[a_is_better ? a : b].place;
        const double most = std::min<double>(max_squared_error_, kSecondBest * error);
        if (!(q.mean(place) <= most) || !keeps(place)) return false;
    }
    if (guard_ && !guard_accepts(h, place)) return false;
    const Half g = twin(h);
    for_each_outgoing(b, [&](Half out) { faces_[out / 4].from[out % 4] = a; });
    // The two triangles along h go; their other edges, one to a and one to b, become one.
    const auto close = [&](Half left, Half right) {
        const Half l = twin(left), r = twin(right);
        pair(l, r);
        points_[from(l)].outgoing = l;
        points_[from(r)].outgoing = r;
    };
    close(next(h), prev(h));
    close(next(g), prev(g));
    for (const Half dead : {h, g}) faces_[dead / 4].from = {kNone, kNone, kNone};
    alive_ -= 2;

    Point &kept = points_[a], &gone = points_[b];
    kept.place = place;
    kept.quadric += gone.quadric;
    kept.version = std::max(kept.version, gone.version) + 1;
    gone.outgoing = kNone;
    return true;
}

void EdgeCollapse::reduce_to(std::size_t triangles, const Progress& progress) {
    const std::size_t from_count = alive_;
    // Queued again while that helps: a collapse that did harm may do none when what is round it has changed.
    for (std::size_t before = 2 * alive_; alive_ > triangles && alive_ < 0.99 * before;) {
        before = alive_;
        lowest_ = buckets_.size();
        queue_all();
        Half h = kNone;
        for (std::size_t tried = 0; alive_ > triangles && (h = pop()) != kNone; ++tried) {
            if (tried % 8192 == 0)
                report_progress(progress, static_cast<double>(from_count - alive_) /
                                              static_cast<double>(from_count - triangles));
            const std::uint32_t kept = from(h);
            if (!collapse(h)) continue;
            points_[kept].changed = true;
            for_each_outgoing(kept, [&](Half out) {
                points_[to(out)].changed = true;
                const Half edge = std::min(out, twin(out));
                if (!is_queued(edge) && !is_fixed(edge)) queue(edge, target(edge).error);
            });
        }
        for (Bucket& bucket : buckets_) bucket = {};
    }
}

Mesh EdgeCollapse::mesh(std::vector<std::uint32_t>* old_triangles) const {
    Mesh result;
    std::vector<std::uint32_t> new_index(points_.size(), kNone);
    for (std::size_t p = 0; p < points_.size(); ++p) {
        if (points_[p].outgoing == kNone) continue;
        new_index[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(to_float(origin_ + points_[p].place));
    }
    result.triangles.reserve(alive_);
    for (std::uint32_t t = 0; t < faces_.size(); ++t) {
        const auto& [a, b, c] = faces_[t].from;
        if (a == kNone) continue;
        result.triangles.push_back({new_index[a], new_index[b], new_index[c]});
        if (old_triangles) old_triangles->push_back(t);
    }
    return result;
}

}  // namespace marrow::internal
