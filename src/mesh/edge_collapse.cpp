#include "edge_collapse.h"

#include <tbb/parallel_for.h>

#include <bit>
#include <numeric>

namespace marrow::internal {

namespace {

constexpr double kPull = 1e-5;  // of a plane's weight: keeps points of flat parts where they are
constexpr int kMostNeighbours = 32;
// A triangle's height over its longest edge: below this a collapse must not make it worse.
constexpr double kThin = 0.05;
constexpr double kTurn = 0.2;  // the least cosine between a triangle's normals before and after

constexpr double kSecondBest = 9;  // how much more than its best an edge's error may be, squared

std::size_t bucket_of(float error) {
    return std::bit_cast<std::uint32_t>(error) >> 19;  // 16 buckets an octave
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
    from_.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) from_.insert(from_.end(), t.begin(), t.end());
    pair_half_edges();
    fix_points();
    sum_quadrics();
}

// Finds each half-edge's twin in the triangle beside it: kNone along open and non-manifold edges.
void EdgeCollapse::pair_half_edges() {
    std::vector<std::size_t> start(points_.size() + 2, 0);
    const auto lower = [&](Half h) { return std::min(from(h), to(h)); };
    const auto higher = [&](Half h) { return std::max(from(h), to(h)); };
    const auto halves = static_cast<Half>(from_.size());
    // Counted two slots on, so that filling leaves start[p] at the begin of p's bucket.
    for (Half h = 0; h < halves; ++h) ++start[lower(h) + std::size_t{2}];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<Half> sorted(halves);
    for (Half h = 0; h < halves; ++h) sorted[start[lower(h) + std::size_t{1}]++] = h;
    twin_.assign(halves, kNone);
    for (std::size_t p = 0; p < points_.size(); ++p) {
        const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(start[p]);
        const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(start[p + 1]);
        std::sort(begin, end, [&](Half a, Half b) { return higher(a) < higher(b); });
        for (auto at = begin; at != end;) {
            auto after = at;
            while (after != end && higher(*after) == higher(*at)) ++after;
            if (after - at == 2 && from(at[0]) != from(at[1])) {
                twin_[at[0]] = at[1];
                twin_[at[1]] = at[0];
            }
            at = after;
        }
    }
}

// Those that have a half-edge without a twin, and those whose triangles are not one fan round them.
void EdgeCollapse::fix_points() {
    std::vector<std::uint32_t> triangles_at(points_.size(), 0);
    for (Half h = 0; h < from_.size(); ++h) {
        points_[from(h)].outgoing = h;
        ++triangles_at[from(h)];
        if (twin_[h] == kNone) points_[from(h)].fixed = points_[to(h)].fixed = true;
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
    for (std::size_t h = 0; h < from_.size(); h += 3) {
        Point* const corners[3] = {&points_[from_[h]], &points_[from_[h + 1]], &points_[from_[h + 2]]};
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
        h = twin_[prev(h)];
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
    lowest_ = std::min(lowest_, bucket);
}

void EdgeCollapse::queue_all() {
    constexpr float kUnasked = -1;
    std::vector<float> errors(from_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, from_.size(), 8192), [&](const auto& range) {
        for (auto h = static_cast<Half>(range.begin()); h < range.end(); ++h) {
            const bool asked = is_alive(h) && twin_[h] != kNone && h < twin_[h] && !is_fixed(h) &&
                               (points_[from(h)].changed || points_[to(h)].changed);
            errors[h] = asked ? target(h).error : kUnasked;
        }
    });
    for (Half h = 0; h < from_.size(); ++h) {
        if (errors[h] != kUnasked) queue(h, errors[h]);
    }
    for (Point& point : points_) point.changed = false;
}

// The entry with the least error whose ends have not changed since; false where there is none.
bool EdgeCollapse::pop(Entry& entry) {
    for (; lowest_ < buckets_.size(); ++lowest_) {
        Bucket& bucket = buckets_[lowest_];
        while (bucket.first < bucket.entries.size()) {
            entry = bucket.entries[bucket.first++];
            if (is_alive(entry.half) && version(entry.half) == entry.version) return true;
        }
        bucket = {};
    }
    return false;
}

// The link condition: the ends of h share exactly the two points opposite to it, and these keep at least three
// triangles each.
bool EdgeCollapse::links_meet_twice(Half h) {
    const std::uint32_t mark = ++last_mark_;
    int neighbours = 0, shared = 0;
    for_each_outgoing(from(h), [&](Half out) {
        points_[to(out)].mark = mark;
        ++neighbours;
    });
    for_each_outgoing(to(h), [&](Half out) {
        shared += points_[to(out)].mark == mark;
        ++neighbours;
    });
    if (shared != 2 || neighbours > kMostNeighbours) return false;
    for (const Half towards : {next(h), next(twin_[h])}) {
        const std::uint32_t opposite = to(towards);
        if (points_[opposite].fixed) continue;  // if it had only three, its triangles would close round it
        int triangles = 0;
        for_each_outgoing(opposite, [&](Half) { ++triangles; });
        if (triangles <= 3) return false;
    }
    return true;
}

// Whether the triangles round `point` that do not have `other` neither turn over nor thin out when it goes to
// `place`. A triangle that is thin already has no normal to speak of: it is asked to face as its fan does.
bool EdgeCollapse::keeps_shape(std::uint32_t point, std::uint32_t other, const Vec3d& place) const {
    const Vec3d& old_place = points_[point].place;
    Vec3d fan_normal{};
    for_each_outgoing(point, [&](Half out) {
        const Vec3d &u = points_[to(out)].place, &w = points_[from(prev(out))].place;
        fan_normal = fan_normal + cross(u - old_place, w - old_place);
    });
    bool keeps = true;
    for_each_outgoing(point, [&](Half out) {
        const std::uint32_t i = to(out), j = from(prev(out));
        if (!keeps || i == other || j == other) return;
        const Vec3d &u = points_[i].place, &w = points_[j].place;
        // Heights over the longest edge, squared: no thinner than kThin, or than before.
        const auto squared_height = [&](const Vec3d& p, const Vec3d& normal) {
            const double longest = std::max({dot(u - p, u - p), dot(w - p, w - p), dot(w - u, w - u)});
            return longest > 0 ? dot(normal, normal) / (longest * longest) : 0;
        };
        const Vec3d old_normal = cross(u - old_place, w - old_place), normal = cross(u - place, w - place);
        const double height = squared_height(place, normal),
                     old_height = squared_height(old_place, old_normal);
        const bool was_thin = !(old_height > kThin * kThin);
        const Vec3d& facing = was_thin ? fan_normal : old_normal;
        const double cosine = dot(facing, normal), sizes = dot(facing, facing) * dot(normal, normal);
        const bool turns = sizes > 0 && !(cosine > 0 && cosine * cosine > kTurn * kTurn * sizes);
        const bool thins = !(height > kThin * kThin) && height < old_height;
        keeps = !turns && !thins;
    });
    return keeps;
}

bool EdgeCollapse::guard_accepts(Half h, const Vec3d& place) {
    patch_.clear();
    const std::uint32_t gone[2] = {h / 3, twin_[h] / 3};
    for (const std::uint32_t end : {from(h), to(h)}) {
        for_each_outgoing(end, [&](Half out) {
            if (out / 3 == gone[0] || out / 3 == gone[1]) return;
            patch_.push_back({out / 3, origin_ + place, origin_ + points_[to(out)].place,
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
    const auto keeps = [&](const Vec3d& p) { return keeps_shape(a, b, p) && keeps_shape(b, a, p); };
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
    const Half g = twin_[h];
    for_each_outgoing(b, [&](Half out) { from_[out] = a; });
    // The two triangles along h go; their other edges, one to a and one to b, become one.
    const auto close = [&](Half left, Half right) {
        const Half l = twin_[left], r = twin_[right];
        twin_[l] = r;
        twin_[r] = l;
        points_[from(l)].outgoing = l;
        points_[from(r)].outgoing = r;
    };
    close(next(h), prev(h));
    close(next(g), prev(g));
    for (const Half dead : {h, g}) from_[dead] = from_[next(dead)] = from_[prev(dead)] = kNone;
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
        Entry entry;
        for (std::size_t tried = 0; alive_ > triangles && pop(entry); ++tried) {
            if (tried % 8192 == 0)
                report(progress, static_cast<double>(from_count - alive_) /
                                     static_cast<double>(from_count - triangles));
            const std::uint32_t kept = from(entry.half);
            if (!collapse(entry.half)) continue;
            points_[kept].changed = true;
            for_each_outgoing(kept, [&](Half out) {
                points_[to(out)].changed = true;
                if (!is_fixed(out)) queue(out, target(out).error);
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
    for (std::size_t h = 0; h < from_.size(); h += 3) {
        if (from_[h] == kNone) continue;
        result.triangles.push_back({new_index[from_[h]], new_index[from_[h + 1]], new_index[from_[h + 2]]});
        if (old_triangles) old_triangles->push_back(static_cast<std::uint32_t>(h / 3));
    }
    return result;
}

}  // namespace marrow::internal
