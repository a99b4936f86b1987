// Finds the pairs of triangles whose bounding boxes overlap, drops those that a plane separates, and decides
// the rest with exact predicates.
//
// Most pairs are neighbours that share a point. They only need a plane through that point, and the plane
// between the directions to the two triangles nearly always does. The planes of the triangles themselves
// separate most of the pairs that share nothing.
#include "self_intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include "box_pyramid.h"
#include "for_each_range.h"
#include "morton_curve.h"
#include "triangle_intersection.h"
#include "triangle_tree.h"
#include "vertex_triangles.h"

namespace marrow::internal {

namespace {

// Returns the far corner of the neighbour across the edge opposite to a corner. Returns nothing if the edge
// does not have exactly two triangles.
std::optional<Vec3d> across_edge(const MeshView& mesh, const VertexTriangles& vertex_triangles,
                                 const Triangle& t, std::size_t corner) {
    const std::uint32_t a = t[(corner + 1) % 3], b = t[(corner + 2) % 3];
    std::uint32_t far = t[corner];
    int triangles = 0;
    for (const Triangle* other = vertex_triangles.begin(a); other != vertex_triangles.end(a); ++other) {
        if ((*other)[1] != b && (*other)[2] != b) continue;
        ++triangles;
        const std::uint32_t third = (*other)[1] == b ? (*other)[2] : (*other)[1];
        if (third != t[corner]) far = third;
    }
    if (triangles != 2) return {};
    return to_double(mesh.points[far]);
}

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

// Decides for pairs of triangles of a mesh whether the surface passes through itself there.
class Decider {
  public:
    explicit Decider(const MeshView& mesh) : mesh_(mesh) {}

    bool pass_through(std::uint32_t i, std::uint32_t j) {
        const Triangle &s = mesh_.triangles[i], &t = mesh_.triangles[j];
        std::size_t shared = 0, at_s = 0, at_t = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t k = 0; k < 3; ++k) {
                if (s[c] == t[k]) ++shared, at_s = c, at_t = k;
            }
        }
        if (shared > 1) return false;
        if (shared == 1 && are_separate_at(point(s[at_s]), point(s[(at_s + 1) % 3]), point(s[(at_s + 2) % 3]),
                                           point(t[(at_t + 1) % 3]), point(t[(at_t + 2) % 3])))
            return false;
        const TriangleCorners corners_s = corners_of(mesh_, s), corners_t = corners_of(mesh_, t);
        const std::optional<TriangleIntersection> found = intersect(corners_s, corners_t);
        if (!found || found->is_of_interiors()) return found.has_value();
        return shared == 0 && continue_beyond(s, corners_s, t, corners_t, *found);
    }

  private:
    Vec3d point(std::uint32_t p) const { return to_double(mesh_.points[p]); }

    // The segment is on an edge. The surface only touches if it continues beyond the edge on the same side.
    bool continue_beyond(const Triangle& s, const TriangleCorners& corners_s, const Triangle& t,
                         const TriangleCorners& corners_t, const TriangleIntersection& found) {
        std::call_once(listed_, [&] { vertex_triangles_.emplace(mesh_); });
        const auto beyond = [&](const Triangle& triangle, const TriangleCorners& corners,
                                const PlaneCut& cut) {
            return cut.is_along_edge() ? across_edge(mesh_, *vertex_triangles_, triangle, cut.apex)
                                       : corners[cut.opposite];
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

    const MeshView mesh_;
    std::once_flag listed_;
    std::optional<VertexTriangles> vertex_triangles_;  // made when a segment is on an edge, which is rare
};

}  // namespace

struct SelfIntersections::Search {
    const MeshView mesh;
    std::vector<MortonKey> curve;
    std::vector<std::uint32_t> on_curve;  // where each triangle is on the curve; made when it is needed
    BoxPyramid pyramid;
    Decider decider;

    explicit Search(const MeshView& wanted)
        : mesh(wanted), curve(along_morton_curve(mesh)), pyramid(boxes()), decider(mesh) {}

    std::vector<Bounds> boxes() const {
        std::vector<Bounds> result(curve.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, curve.size(), 4096), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                result[i] = bounds_of(mesh, mesh.triangles[curve[i].triangle]);
        });
        return result;
    }

    // Adds the pairs to `found` at which the surface passes through itself.
    void decide(const std::vector<BoxPair>& near, std::vector<TrianglePair>& found) {
        for (const auto& [a, b] : near) {
            const auto [i, j] = std::minmax(curve[a].triangle, curve[b].triangle);
            if (decider.pass_through(i, j)) found.push_back({i, j});
        }
    }
};

SelfIntersections::SelfIntersections(MeshView mesh) : search_(std::make_unique<Search>(mesh)) {}
SelfIntersections::~SelfIntersections() = default;

std::vector<TrianglePair> SelfIntersections::find_all(const Progress& progress, double begin,
                                                      double end) const {
    std::mutex mutex;
    std::vector<TrianglePair> all;
    const BoxPyramid& pyramid = search_->pyramid;
    for_each_range(pyramid.units(), 16, progress, begin, end, [&](std::size_t first, std::size_t last) {
        std::vector<BoxPair> near;
        std::vector<TrianglePair> found;
        for (std::size_t unit = first; unit < last; ++unit) {
            near.clear();
            pyramid.pairs_from(unit, near);
            search_->decide(near, found);
        }
        if (found.empty()) return;
        const std::lock_guard lock(mutex);
        all.insert(all.end(), found.begin(), found.end());
    });
    std::sort(all.begin(), all.end());
    return all;
}

std::vector<TrianglePair> SelfIntersections::find_changed(const std::vector<std::uint32_t>& changed) {
    Search& s = *search_;
    if (s.on_curve.empty()) {
        s.on_curve.resize(s.curve.size());
        for (std::uint32_t i = 0; i < s.curve.size(); ++i) s.on_curve[s.curve[i].triangle] = i;
    }
    for (const std::uint32_t t : changed)
        s.pyramid.set(s.on_curve[t], bounds_of(s.mesh, s.mesh.triangles[t]));
    std::vector<BoxPair> near;
    for (const std::uint32_t t : changed) s.pyramid.pairs_with(s.on_curve[t], near);
    std::vector<TrianglePair> found;
    s.decide(near, found);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

}  // namespace marrow::internal
