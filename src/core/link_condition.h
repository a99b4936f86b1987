/// Which points of a surface can become one so that it stays a manifold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <marrow/mesh.h>

namespace marrow::internal {

/// The link condition, asked of the points of a few slices by the triangles round them.
class LinkCondition {
  public:
    /// Of the points [first_point, end_point), all of whose triangles are among [first_triangle,
    /// end_triangle). Joined points round them are in [first_mark, end_mark).
    LinkCondition(const Mesh& mesh, std::uint32_t first_point, std::uint32_t end_point,
                  std::uint64_t first_triangle, std::uint64_t end_triangle, std::uint32_t first_mark,
                  std::uint32_t end_mark)
        : first_point_(first_point),
          first_mark_(first_mark),
          ends_(end_point - first_point + 1, 0),
          marks_(end_mark - first_mark) {
        const auto is_ours = [=](std::uint32_t p) { return p >= first_point && p < end_point; };
        for (std::uint64_t t = first_triangle; t < end_triangle; ++t) {
            for (const std::uint32_t p : mesh.triangles[t]) {
                if (is_ours(p)) ++ends_[p - first_point + 1];
            }
        }
        std::partial_sum(ends_.begin(), ends_.end(), ends_.begin());
        edges_.resize(ends_.back());
        // While edges are filled in, ends_[i] is where the next one of point i goes; then it is where they
        // end.
        for (std::uint64_t t = first_triangle; t < end_triangle; ++t) {
            const auto [p, q, r] = mesh.triangles[t];
            if (is_ours(p)) edges_[ends_[p - first_point]++] = {q, r};
            if (is_ours(q)) edges_[ends_[q - first_point]++] = {r, p};
            if (is_ours(r)) edges_[ends_[r - first_point]++] = {p, q};
        }
    }

    /// Whether `points` can become one where others became `joined`: whether the triangles that are left
    /// round them make one fan, closed or, at the surface's border, open; and no point beside them loses all
    /// of its own.
    bool holds(const std::vector<std::uint32_t>& points, const std::vector<std::uint32_t>& joined,
               bool at_border) {
        ++now_;
        std::size_t most = 0;
        for (const std::uint32_t p : points) {
            mark(p).inside = now_;
            most += edges_of(p).size();
        }
        if (rim_.size() <= most) {
            rim_.resize(most + 1);
            beside_.resize(most + 1);
        }
        // Without branches that depend on the triangles: they could not be foreseen.
        std::size_t rim = 0, beside = 0;
        for (const std::uint32_t p : points) {
            for (const Edge& edge : edges_of(p)) {
                const std::uint32_t a = joined[edge.from], b = joined[edge.to];
                const bool a_inside = mark(a).inside == now_, b_inside = mark(b).inside == now_;
                rim_[rim] = {a, b};
                rim += (a != b) & !(a_inside | b_inside);
                beside_[beside] = a_inside ? b : a;
                beside += a_inside != b_inside;
            }
        }
        if (rim < (at_border ? 1u : 3u)) return false;
        bool simple = true;
        for (std::size_t k = 0; k < rim; ++k) {
            Mark &from = mark(rim_[k].from), &to = mark(rim_[k].to);
            simple = simple & (from.left != now_) & (to.reached != now_);
            from.left = to.reached = now_;
            from.next = rim_[k].to;
        }
        for (std::size_t k = 0; k < beside; ++k)
            simple = simple && (mark(beside_[k]).left == now_ || mark(beside_[k]).reached == now_);
        if (!simple) return false;

        // Round the rim from any of its points, or from its one beginning.
        std::uint32_t start = rim_[0].from;
        if (at_border) {
            std::size_t beginnings = 0;
            for (std::size_t k = 0; k < rim; ++k) {
                if (mark(rim_[k].from).reached != now_) start = rim_[k].from, ++beginnings;
            }
            if (beginnings != 1) return false;
        }
        std::uint32_t at = start;
        std::size_t steps = 0;
        do at = mark(at).next, ++steps;
        while (at != start && mark(at).left == now_);
        return steps == rim && (at_border || at == start);
    }

  private:
    struct Edge {
        std::uint32_t from, to;
    };
    // What is known of a point; of the present test where it is its number.
    struct Mark {
        std::uint32_t inside = 0, left = 0, reached = 0;
        std::uint32_t next = 0;
    };
    Mark& mark(std::uint32_t point) { return marks_[point - first_mark_]; }
    // The edges opposite a point in its triangles.
    std::span<const Edge> edges_of(std::uint32_t point) const {
        const std::size_t i = point - first_point_;
        const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
        return {edges_.data() + begin, ends_[i] - begin};
    }

    const std::uint32_t first_point_, first_mark_;
    std::vector<std::uint64_t> ends_;  // in edges_, of the points' own
    std::vector<Edge> edges_;
    std::vector<Mark> marks_;
    std::vector<Edge> rim_;              // scratch: the edges round the points
    std::vector<std::uint32_t> beside_;  // and the points that share a triangle with two of them
    std::uint32_t now_ = 0;
};

}  // namespace marrow::internal
