// Finds the pairs of triangles whose bounding boxes overlap, and decides them with exact predicates.
//
// Where the surface is a height field, no pairs need to be looked at. Elsewhere, most pairs are neighbours
// that share a point. At nearly all points, one look at all triangles around the point proves that they do
// not intersect. At the others, pairs only need a plane through the point, and the plane between the
// directions to the two triangles nearly always does.
#include "self_intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>

#include "base/for_each_range.h"
#include "base/parallel.h"
#include "block_pairs.h"
#include "height_fields.h"
#include "mesh/geometry/triangle_intersection.h"
#include "mesh/search/triangle_tree.h"
#include "simple_fans.h"

namespace marrow::internal {

namespace {

// Whether a plane through a common corner p, between the directions to the triangles p, a, b and p, c, d, has
// these on different sides. False if rounding could be wrong.
bool are_separate_at(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const Vec3d to_a = a - p, to_b = b - p, to_c = c - p, to_d = d - p;
    const Vec3d s = to_a + to_b, t = to_c + to_d;
    const double ss = dot(s, s), tt = dot(t, t);
    // Any normal will do. This one is perpendicular to the plane halfway between if the lengths are equal.
    const Vec3d normal = tt * s - ss * t;
    // The products below are at most 2e5 ss tt, so that this is far above their rounding errors.
    const double longest = dot(to_a, to_a) + dot(to_b, to_b) + dot(to_c, to_c) + dot(to_d, to_d);
    if (!(longest * (ss + tt) < 1e10 * ss * tt)) return false;
    const double least = 1e-8 * ss * tt;
    return dot(normal, to_a) > least && dot(normal, to_b) > least && dot(normal, to_c) < -least &&
           dot(normal, to_d) < -least;
}

// A line segment that two triangles have in common, which do not share an edge.
struct Contact {
    TriangleIntersection found;
    bool at_point;  // they share a point
};

std::optional<Contact> find_contact(const MeshView& mesh, std::uint32_t i, std::uint32_t j) {
    const Triangle &s = mesh.triangles[i], &t = mesh.triangles[j];
    std::size_t shared = 0, at_s = 0, at_t = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t k = 0; k < 3; ++k) {
            if (s[c] == t[k]) ++shared, at_s = c, at_t = k;
        }
    }
    if (shared > 1) return {};
    const auto point = [&](const Triangle& triangle, std::size_t corner) {
        return to_double(mesh.points[triangle[corner % 3]]);
    };
    if (shared == 1 && are_separate_at(point(s, at_s), point(s, at_s + 1), point(s, at_s + 2),
                                       point(t, at_t + 1), point(t, at_t + 2)))
        return {};
    const std::optional<TriangleIntersection> found = intersect(corners_of(mesh, s), corners_of(mesh, t));
    if (!found) return {};
    return Contact{*found, shared == 1};
}

// Decides for pairs of triangles of a mesh whether the surface passes through itself there.
class Decider {
  public:
    // `rings` may be those of a mesh with more triangles. Then all triangles at points that are no
    // fans belong to `mesh`. If it is null, then none are missing that meet a point where
    // triangles of `mesh` could intersect. A pyramid is only made, on first use, if there is none.
    Decider(const MeshView& mesh, const TrianglePyramid* pyramid, const OneRings* rings)
        : mesh_(mesh), pyramid_(pyramid), rings_(rings) {}

    bool pass_through(std::uint32_t i, std::uint32_t j) const {
        const std::optional<Contact> contact = find_contact(mesh_, i, j);
        if (!contact || contact->found.is_of_interiors()) return contact.has_value();
        return !contact->at_point &&
               continue_beyond(mesh_.triangles[i], corners_of(mesh_, mesh_.triangles[i]), mesh_.triangles[j],
                               corners_of(mesh_, mesh_.triangles[j]), contact->found);
    }

  private:
    Vec3d point(std::uint32_t p) const { return to_double(mesh_.points[p]); }

    const TrianglePyramid& pyramid() const {
        if (pyramid_) return *pyramid_;
        // Otherwise this thread could decide another pair while it waits, and then wait for itself.
        std::call_once(is_made_, [&] { isolate([&] { made_.emplace(mesh_); }); });
        return *made_;
    }

    // The segment is on an edge. The surface only touches if it continues beyond the edge on the same side.
    bool continue_beyond(const Triangle& s, const TriangleCorners& corners_s, const Triangle& t,
                         const TriangleCorners& corners_t, const TriangleIntersection& found) const {
        const auto beyond = [&](const Triangle& triangle, const TriangleCorners& corners,
                                const PlaneCut& cut) {
            return cut.is_along_edge() ? across_edge(triangle, cut.apex) : corners[cut.opposite];
        };
        const std::optional<Vec3d> beyond_s = beyond(s, corners_s, found.s),
                                   beyond_t = beyond(t, corners_t, found.t);
        if (!beyond_s || !beyond_t) return false;
        const bool on_s = found.s.is_along_edge();
        const TriangleCorners& corners = on_s ? corners_s : corners_t;
        const std::size_t apex = on_s ? found.s.apex : found.t.apex;
        return sheets_cross(corners[(apex + 1) % 3], corners[(apex + 2) % 3],
                            {corners_s[found.s.apex], *beyond_s}, {corners_t[found.t.apex], *beyond_t});
    }

    // Returns the far corner of the neighbour across the edge opposite to a corner. Returns nothing if the
    // edge does not have exactly two triangles.
    std::optional<Vec3d> across_edge(const Triangle& triangle, std::size_t corner) const {
        const std::uint32_t a = triangle[(corner + 1) % 3], b = triangle[(corner + 2) % 3];
        for (const auto& [from, to] : {std::array{a, b}, std::array{b, a}}) {
            if (rings_ && rings_->is_fan(from)) return across_spoke(from, to, triangle[corner]);
        }
        Bounds edge;
        edge.include(mesh_.points[a]);
        edge.include(mesh_.points[b]);
        std::uint32_t far = triangle[corner];
        int triangles = 0;
        for (const std::uint32_t t : pyramid().overlapping(edge)) {
            std::uint32_t third = a;
            int others = 0;
            for (const std::uint32_t p : mesh_.triangles[t]) {
                if (p != a && p != b) third = p, ++others;
            }
            if (others > 1) continue;
            ++triangles;
            if (third != triangle[corner]) far = third;
        }
        if (triangles != 2) return {};
        return to_double(mesh_.points[far]);
    }

    // The same for an edge from the centre of a fan.
    Vec3d across_spoke(std::uint32_t centre, std::uint32_t end, std::uint32_t corner) const {
        const std::span<const std::uint32_t> ring = rings_->of(centre);
        const auto at = static_cast<std::size_t>(std::find(ring.begin(), ring.end(), end) - ring.begin());
        const std::uint32_t next = ring[(at + 1) % ring.size()],
                            before = ring[(at + ring.size() - 1) % ring.size()];
        return point(next == corner ? before : next);
    }

    const MeshView mesh_;
    const TrianglePyramid* const pyramid_;
    const OneRings* const rings_;
    mutable std::once_flag is_made_;
    mutable std::optional<TrianglePyramid> made_;
};

// Sorts a list, and leaves only one of equal elements.
template <class List>
void sort_out(List& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
}

Buffer<Triangle> triangles_of(const MeshView& mesh, const Buffer<std::uint32_t>& numbers) {
    Buffer<Triangle> triangles(numbers.size());
    parallel_for_ranges(std::size_t{0}, numbers.size(), 4096, [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) triangles[i] = mesh.triangles[numbers[i]];
    });
    return triangles;
}

// Finds the pairs of a mesh of some triangles of another. `numbers` are those in the other one, in ascending
// order. find(part, pairs) appends those that may intersect in a part of the search.
template <class Find>
std::vector<TrianglePair> find_pairs(const Decider& decider, std::size_t parts, std::size_t together,
                                     const Find& find, const Buffer<std::uint32_t>& numbers,
                                     const Progress& progress, double begin, double end) {
    std::mutex mutex;
    std::vector<TrianglePair> all;
    for_each_range(parts, together, progress, begin, end, [&](std::size_t first, std::size_t last) {
        std::vector<TrianglePair> pairs, found;
        // One part at a time, as the triangles of a long fan make many pairs.
        for (std::size_t part = first; part < last; ++part) {
            pairs.clear();
            find(part, pairs);
            std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(found),
                         [&](const TrianglePair& pair) { return decider.pass_through(pair[0], pair[1]); });
        }
        if (found.empty()) return;
        const std::lock_guard lock(mutex);
        for (const auto& [s, t] : found) all.push_back({numbers[s], numbers[t]});
    });
    sort_out(all);
    return all;
}

// The same, with a pyramid of the mesh.
std::vector<TrianglePair> find_pairs(const MeshView& mesh, const TrianglePyramid& pyramid,
                                     const OneRings* rings, const Buffer<std::uint32_t>& numbers,
                                     const Progress& progress, double begin, double end) {
    const auto find = [&](std::size_t unit, std::vector<TrianglePair>& pairs) {
        pyramid.pairs_from(unit, unit + 1, pairs);
    };
    return find_pairs(Decider(mesh, &pyramid, rings), pyramid.units(), 64, find, numbers, progress, begin,
                      end);
}

}  // namespace

std::vector<TrianglePair> find_self_intersections(const MeshView& mesh, const OneRings& rings,
                                                  const std::optional<TriangleBlocks>& blocks,
                                                  const Progress& progress, double begin, double end) {
    if (!blocks) {
        Buffer<std::uint32_t> all(mesh.triangles.size());
        std::iota(all.begin(), all.end(), std::uint32_t{0});
        const TrianglePyramid pyramid(mesh, find_simple_fans(mesh, rings));
        return find_pairs(mesh, pyramid, &rings, all, progress, begin, end);
    }
    // So that each of these steps can be cancelled.
    const auto next_step = [&] { report_progress(progress, begin); };
    next_step();
    const Buffer<std::uint8_t> wanted = blocks_outside_height_fields(*blocks);
    next_step();
    const Buffer<std::uint32_t> numbers = triangles_in(*blocks, wanted);
    const Buffer<Triangle> triangles = triangles_of(mesh, numbers);
    next_step();
    const MeshView rest(mesh.points, triangles);
    const Buffer<std::uint8_t> simple = find_simple_fans(rest, rings);
    next_step();
    const Decider decider(rest, nullptr, &rings);
    const BlockPairs search(rest, *blocks, numbers, wanted, simple);
    next_step();
    std::mutex mutex;
    Buffer<std::uint32_t> crowded;
    const auto find = [&](std::size_t part, std::vector<TrianglePair>& pairs) {
        std::vector<std::uint32_t> in_crowds;
        search.pairs_in(part, pairs, in_crowds);
        const std::lock_guard lock(mutex);
        crowded.insert(crowded.end(), in_crowds.begin(), in_crowds.end());
    };
    std::vector<TrianglePair> found =
        find_pairs(decider, search.parts(), 1, find, numbers, progress, begin, end);
    if (crowded.empty()) return found;
    sort_out(crowded);
    const Buffer<Triangle> crowd = triangles_of(rest, crowded);
    const TrianglePyramid pyramid(MeshView(mesh.points, crowd), simple);
    const auto find_in_crowd = [&](std::size_t unit, std::vector<TrianglePair>& pairs) {
        pyramid.pairs_from(unit, unit + 1, pairs);
        for (auto& [s, t] : pairs) s = crowded[s], t = crowded[t];
    };
    const std::vector<TrianglePair> more =
        find_pairs(decider, pyramid.units(), 64, find_in_crowd, numbers, progress, end, end);
    found.insert(found.end(), more.begin(), more.end());
    sort_out(found);
    return found;
}

std::vector<TrianglePair> find_self_intersections(const MeshView& mesh, const OneRings& rings,
                                                  const Progress& progress, double begin, double end) {
    return find_self_intersections(mesh, rings, find_triangle_blocks(mesh, rings), progress, begin, end);
}

std::vector<TrianglePair> find_self_intersections_among(const MeshView& mesh,
                                                        const Buffer<std::uint32_t>& triangles,
                                                        const Progress& progress, double begin, double end) {
    const Buffer<Triangle> listed = triangles_of(mesh, triangles);
    const MeshView part(mesh.points, listed);
    return find_pairs(part, TrianglePyramid(part), nullptr, triangles, progress, begin, end);
}

bool may_pass_through(const MeshView& mesh, const TrianglePair& pair) {
    return find_contact(mesh, pair[0], pair[1]).has_value();
}

struct SelfIntersections::Search {
    const MeshView mesh;
    TrianglePyramid pyramid;
    Decider decider;

    explicit Search(const MeshView& wanted) : mesh(wanted), pyramid(mesh), decider(mesh, &pyramid, nullptr) {}
};

SelfIntersections::SelfIntersections(MeshView mesh) : search_(std::make_unique<Search>(mesh)) {}
SelfIntersections::SelfIntersections(SelfIntersections&&) noexcept = default;
SelfIntersections::~SelfIntersections() = default;

std::vector<TrianglePair> SelfIntersections::find_changed(const std::vector<std::uint32_t>& changed) {
    const Search& s = *search_;
    update(changed);
    std::mutex mutex;
    std::vector<TrianglePair> found;
    parallel_for_ranges(std::size_t{0}, changed.size(), 64, [&](const auto& range) {
        for (std::size_t c = range.begin(); c < range.end(); ++c) {
            const std::uint32_t t = changed[c];
            for (const std::uint32_t other : s.pyramid.overlapping(bounds_of(s.mesh, s.mesh.triangles[t]))) {
                const auto [i, j] = std::minmax(t, other);
                if (i == j || !s.decider.pass_through(i, j)) continue;
                const std::lock_guard lock(mutex);
                found.push_back({i, j});
            }
        }
    });
    sort_out(found);
    return found;
}

bool SelfIntersections::any_changed_pair(const std::vector<std::uint32_t>& changed) {
    const Search& s = *search_;
    update(changed);
    const auto box_of = [&](std::uint32_t t) { return bounds_of(s.mesh, s.mesh.triangles[t]); };
    Bounds all;
    for (const std::uint32_t t : changed) all.include(box_of(t));
    for (const std::uint32_t other : s.pyramid.overlapping(all)) {
        const Bounds box = box_of(other);
        // A changed triangle is compared with those that are listed before it.
        const auto end = std::find(changed.begin(), changed.end(), other);
        const bool found = std::any_of(changed.begin(), end, [&](std::uint32_t t) {
            return box.overlaps(box_of(t)) && s.decider.pass_through(std::min(t, other), std::max(t, other));
        });
        if (found) return true;
    }
    return false;
}

void SelfIntersections::update(const std::vector<std::uint32_t>& changed) {
    for (const std::uint32_t t : changed)
        search_->pyramid.set_box(t, bounds_of(search_->mesh, search_->mesh.triangles[t]));
}

void SelfIntersections::remove(std::uint32_t triangle) {
    search_->pyramid.set_box(triangle, Bounds{});
}

std::vector<std::uint32_t> SelfIntersections::triangles_at(std::uint32_t point) const {
    Bounds box;
    box.include(search_->mesh.points[point]);
    std::vector<std::uint32_t> triangles = search_->pyramid.overlapping(box);
    std::erase_if(triangles, [&](std::uint32_t t) {
        const Triangle& corners = search_->mesh.triangles[t];
        return std::find(corners.begin(), corners.end(), point) == corners.end();
    });
    return triangles;
}

}  // namespace marrow::internal
