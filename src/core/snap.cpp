// Snapping joins points of the finished surface, after SnapMC (Raman and Wenger 2008), with two differences:
// the joined point lies amid the points that it is made of instead of at the sample, so that the surface
// stays where it is; and every joining is checked on the surface itself, so that it stays a manifold whatever
// the samples.
//
// 1. Every point belongs to the nearer end of its edge: at most six belong to one sample.
// 2. Sample by sample, those of its points that hang together become one, if the triangles that are left
//    round it make one fan. If not, those too close to the sample are moved away from it.
// 3. A point that lies nearly on the line between the two others of a triangle is moved aside.
// 4. What is left moves together and is numbered anew.
//
// Whether points can join depends on what joined before, so the order is fixed: blocks of slices, which have
// no triangle in common but at their borders, at the same time; then the slices at the borders.
#include "snap.h"

#include <hwy/highway.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "link_condition.h"
#include "pipeline.h"
#include "row_bits-inl.h"

namespace marrow::internal {

namespace {

using HWY_NAMESPACE::for_each_active_word;
using HWY_NAMESPACE::GridRow;
using HWY_NAMESPACE::kRow;
using HWY_NAMESPACE::RowBits;

// A point of the surface as the nearer end of its edge sees it. Lengths are in edges.
struct NearPoint {
    float offset;  // from it along the axis of the edge, -0.5 to 0.5
    float moved;   // how far, at most, what became this point was moved
    std::uint8_t axis;
    bool first;          // whether the sample is the edge's first end
    std::uint8_t faces;  // in which the edge lies, of an open volume's box: bit a where it ends along axis a
};

// From a sample, in edges along each axis.
using Offset = std::array<float, 3>;

Offset offset_of(const NearPoint& point) {
    Offset offset{0, 0, 0};
    offset[point.axis] = point.offset;
    return offset;
}

float distance(const Offset& a, const Offset& b) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

Vec3d operator-(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vec3d operator*(double s, const Vec3d& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const Vec3d& a) {
    return std::sqrt(dot(a, a));
}

constexpr std::uint32_t kNone = ~std::uint32_t{0};

class Snapping {
  public:
    Snapping(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh)
        : input_(input),
          limit_(static_cast<float>(limit)),
          mesh_(mesh),
          row_samples_(64 * input.bits.words_per_row + 1),
          slice_samples_(row_samples_ * static_cast<std::uint64_t>(input.bits.ny)),
          slices_(static_cast<std::size_t>(input.bits.nz)),
          blocks_((slices_ + kBlock - 1) / kBlock),
          stage_(progress, 0.6, 1, 2 * blocks_ - 1),
          samples_(mesh.points.size()),
          points_(mesh.points.size()),
          joined_(mesh.points.size()),
          end_triangle_(slices_) {
        for (std::int64_t z = 0; z <= input.bits.nz; ++z) {
            first_point_.push_back(
                static_cast<std::uint32_t>(input.points.first_output(input.bits.row_index(0, z))));
            first_triangle_.push_back(input.triangles.first_output(input.bits.row_index(0, z)));
        }
        const Mat3d& m = input.frame.exact;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
            for (std::size_t r = 0; r < 3; ++r) {
                const std::size_t s = (r + 1) % 3, t = (r + 2) % 3;
                to_edges_[a][r] = m[s][b] * m[t][c] - m[t][b] * m[s][c];
            }
            const double determinant = dot(to_edges_[a], {m[0][a], m[1][a], m[2][a]});
            to_edges_[a] = 1 / determinant * to_edges_[a];
        }
    }

    std::size_t bytes() const {
        return joined_.size() * (sizeof samples_[0] + sizeof points_[0] + sizeof joined_[0]);
    }

    void find_samples() {
        for_each_share(input_.points, 0, input_.bits.rows(), [&](std::size_t begin, std::size_t end) {
            auto point = static_cast<std::uint32_t>(input_.points.first_output(begin));
            for (std::size_t r = begin; r < end; ++r) {
                if (input_.points.leaves()[r] == 0) continue;
                const RowBits row(input_.bits, GridRow(input_.bits, r));
                find_samples_along(0, r, point, [&](std::size_t w) { return row.crossed_x(kRow, w); });
                find_samples_along(1, r, point, [&](std::size_t w) { return row.crossed_y(w); });
                find_samples_along(2, r, point, [&](std::size_t w) { return row.crossed_z(w); });
            }
        });
    }

    void join() {
        const auto begin = [&](std::size_t block) { return block == 0 ? 0 : block * kBlock + kBorder; };
        const auto end = [&](std::size_t block) {
            return block + 1 == blocks_ ? slices_ : (block + 1) * kBlock - kBorder;
        };
        tbb::parallel_for(std::size_t{0}, blocks_, [&](std::size_t b) {
            join_in(begin(b), end(b));
            stage_.step();
        });
        tbb::parallel_for(std::size_t{1}, blocks_, [&](std::size_t b) {
            join_in(end(b - 1), std::min(begin(b), slices_));
            stage_.step();
        });
    }

    // Takes out the triangles that collapsed. Points keep their numbers; triangles name those that others became.
    void take_out_collapsed() {
        tbb::parallel_for(std::size_t{0}, slices_, [&](std::size_t z) {
            Triangle* const triangles = mesh_.triangles.data();
            std::uint64_t left = first_triangle_[z];
            for (std::uint64_t t = left; t < first_triangle_[z + 1]; ++t) {
                const auto [p, q, r] = triangles[t];
                const std::uint32_t a = joined_[p], b = joined_[q], c = joined_[r];
                triangles[left] = {a, b, c};
                left += (a != b) & (b != c) & (c != a);
            }
            end_triangle_[z] = left;
        });
    }

    // Moves a point aside that lies nearly on the line between the others of a triangle, as far as it may still
    // move.
    void move_aside() {
        std::vector<std::vector<std::uint64_t>> flat(slices_);  // triangles by slice
        tbb::parallel_for(std::size_t{0}, slices_, [&](std::size_t z) {
            for (std::uint64_t t = first_triangle_[z]; t < end_triangle_[z]; ++t) {
                if (find_flat_corner(t)) flat[z].push_back(t);
            }
        });
        for (const auto& triangles : flat) {
            for (const std::uint64_t t : triangles) {
                if (const auto corner = find_flat_corner(t)) move_aside(corner->point, corner->step);
            }
        }
    }

    // Numbers the points that are left anew and moves everything to the front.
    void close_up() {
        std::vector<std::uint32_t>& number = joined_;  // of the points that are left
        std::vector<std::uint32_t> kept(slices_ + 1, 0);
        tbb::parallel_for(std::size_t{0}, slices_, [&](std::size_t z) {
            for (std::uint32_t p = first_point_[z]; p < first_point_[z + 1]; ++p)
                kept[z + 1] += joined_[p] == p;
        });
        std::partial_sum(kept.begin(), kept.end(), kept.begin());
        tbb::parallel_for(std::size_t{0}, slices_, [&](std::size_t z) {
            std::uint32_t next = kept[z], to = first_point_[z];
            for (std::uint32_t p = first_point_[z]; p < first_point_[z + 1]; ++p) {
                if (joined_[p] != p) continue;
                mesh_.points[to] = mesh_.points[p];
                if (!mesh_.normals.empty()) mesh_.normals[to] = mesh_.normals[p];
                ++to;
                number[p] = next++;
            }
        });
        tbb::parallel_for(std::size_t{0}, slices_, [&](std::size_t z) {
            for (std::uint64_t t = first_triangle_[z]; t < end_triangle_[z]; ++t) {
                for (std::uint32_t& p : mesh_.triangles[t]) p = number[p];
            }
        });
        std::uint64_t end = 0;
        for (std::size_t z = 0; z < slices_; ++z) {
            const auto move = [](auto& buffer, std::uint64_t from, std::uint64_t to, std::uint64_t count) {
                const auto first = buffer.begin() + static_cast<std::ptrdiff_t>(from);
                std::copy(first, first + static_cast<std::ptrdiff_t>(count),
                          buffer.begin() + static_cast<std::ptrdiff_t>(to));
            };
            const std::uint64_t points = kept[z + 1] - kept[z],
                                triangles = end_triangle_[z] - first_triangle_[z];
            move(mesh_.points, first_point_[z], kept[z], points);
            if (!mesh_.normals.empty()) move(mesh_.normals, first_point_[z], kept[z], points);
            move(mesh_.triangles, first_triangle_[z], end, triangles);
            end += triangles;
        }
        mesh_.points.resize(kept.back());
        if (!mesh_.normals.empty()) mesh_.normals.resize(kept.back());
        mesh_.triangles.resize(end);
    }

  private:
    // Joining round a sample of slice z looks at points of the slices z - 2 to z + 1, and at what they became
    // round samples of these slices and the next.
    static constexpr std::size_t kBlock = 32, kBorder = 2;

    // For the points on the edges along an axis that start in a row, in the order of `point`, which advances.
    template <class Words>
    void find_samples_along(std::uint8_t axis, std::size_t row, std::uint32_t& point, const Words& crossed) {
        const InsideBits& bits = input_.bits;
        const auto& dims = input_.volume.geometry.dims;
        const std::int64_t y = static_cast<std::int64_t>(row) % bits.ny - bits.pad;
        const std::int64_t z = static_cast<std::int64_t>(row) / bits.ny - bits.pad;
        const auto face = [&](std::uint8_t a, std::int64_t index) {
            const bool in_face = bits.pad == 0 && a != axis && (index == 0 || index + 1 == dims[a]);
            return static_cast<std::uint8_t>(in_face ? 1u << a : 0u);
        };
        const auto row_faces = static_cast<std::uint8_t>(face(1, y) | face(2, z));

        const Vec3f base = input_.frame.row_base(y, z);
        Vec3f per_edge;  // the scalar product with it is in edges
        float squared = 0;
        for (std::size_t r = 0; r < 3; ++r)
            squared += input_.frame.matrix[r][axis] * input_.frame.matrix[r][axis];
        for (std::size_t r = 0; r < 3; ++r) per_edge[r] = input_.frame.matrix[r][axis] / squared;
        const std::uint64_t steps[3] = {1, row_samples_, slice_samples_};

        for_each_active_word(input_.active, row, [&](std::size_t w) {
            for (std::uint64_t set = crossed(w); set != 0; set &= set - 1, ++point) {
                const std::size_t bit = 64 * w + static_cast<std::size_t>(__builtin_ctzll(set));
                const std::int64_t x = static_cast<std::int64_t>(bit) - bits.first_x;
                const Vec3f first = input_.frame.point(base, static_cast<float>(x), axis, 0);
                float fraction = 0;
                for (std::size_t r = 0; r < 3; ++r)
                    fraction += (mesh_.points[point][r] - first[r]) * per_edge[r];
                fraction = fraction > 0 ? std::min(fraction, 1.0f) : 0;  // also where it is NaN
                const bool at_first = fraction <= 0.5f;
                samples_[point] = row * row_samples_ + bit + (at_first ? 0 : steps[axis]);
                points_[point] = {at_first ? fraction : fraction - 1, 0, axis, at_first,
                                  static_cast<std::uint8_t>(row_faces | face(0, x))};
                joined_[point] = point;
            }
        });
    }

    // Joins round the samples of slices [begin, end). Their points are in these slices and the one before,
    // the triangles of those one slice further, and what these triangles' points became another.
    void join_in(std::size_t begin, std::size_t end) {
        if (begin >= end) return;
        const auto back = [&](std::size_t slices) { return begin < slices ? 0 : begin - slices; };
        const std::uint32_t first_point = first_point_[back(1)], end_point = first_point_[end];
        LinkCondition link(mesh_, first_point, end_point, first_triangle_[back(2)], first_triangle_[end],
                           first_point_[back(3)], first_point_[std::min(end + 1, slices_)]);
        std::vector<std::uint32_t> next = link_points_of_samples(begin, end);
        std::vector<std::uint32_t> round;
        for (std::uint32_t p = first_point; p < end_point; ++p) {
            if (next[p - first_point] == kNone) continue;
            bool near = false;
            round.clear();
            for (std::uint32_t q = p; q != kNone;) {
                round.push_back(q);
                near = near || std::abs(points_[q].offset) <= limit_;
                q = std::exchange(next[q - first_point], kNone);
            }
            if (near) join_round_sample(link, round);
        }
    }

    // For each point of the slices [begin, end) and the one before, the next one that belongs to the same
    // sample and hangs together with it; kNone behind the last.
    std::vector<std::uint32_t> link_points_of_samples(std::size_t begin, std::size_t end) const {
        const auto back = [&](std::size_t slices) { return begin < slices ? 0 : begin - slices; };
        const std::uint32_t first_point = first_point_[back(1)], end_point = first_point_[end];
        const std::uint64_t first_sample = begin * slice_samples_, end_sample = end * slice_samples_;
        // Towards the first of those that hang together.
        std::vector<std::uint32_t> first_of(end_point - first_point);
        for (std::uint32_t p = first_point; p < end_point; ++p) first_of[p - first_point] = p;
        const auto find_first = [&](std::uint32_t p) {
            while (first_of[p - first_point] != p) p = first_of[p - first_point];
            return p;
        };
        const auto link = [&](std::uint32_t p, std::uint32_t q) {
            if (samples_[p] < first_sample || samples_[p] >= end_sample) return;
            const std::uint32_t a = find_first(p), b = find_first(q);
            first_of[std::max(a, b) - first_point] = std::min(a, b);
        };
        // Few sides link points, and which is not to be foreseen: they are collected without a branch.
        constexpr std::size_t kBatch = 512;
        std::array<std::array<std::uint32_t, 2>, kBatch + 3> sides;
        std::size_t found = 0;
        for (std::uint64_t t = first_triangle_[back(2)]; t < first_triangle_[end]; ++t) {
            const auto [p, q, r] = mesh_.triangles[t];
            const std::uint64_t of_p = samples_[p], of_q = samples_[q], of_r = samples_[r];
            sides[found] = {p, q};
            found += of_p == of_q;
            sides[found] = {q, r};
            found += of_q == of_r;
            sides[found] = {r, p};
            found += of_r == of_p;
            if (found >= kBatch || t + 1 == first_triangle_[end]) {
                for (std::size_t k = 0; k < found; ++k) link(sides[k][0], sides[k][1]);
                found = 0;
            }
        }
        std::vector<std::uint32_t> next(end_point - first_point, kNone);
        for (std::uint32_t p = end_point; p-- > first_point;) {
            const std::uint32_t first = find_first(p);
            if (first != p) next[p - first_point] = std::exchange(next[first - first_point], p);
        }
        return next;
    }

    void join_round_sample(LinkCondition& link, std::vector<std::uint32_t>& round) {
        std::vector<std::uint32_t> joining = round;
        const Offset middle = find_middle(joining);
        if (joining.size() > 1 && link.holds(joining, joined_, faces_of(joining) != 0)) {
            become_one(joining, middle);
        } else {
            for (const std::uint32_t p : round) move_away(p);
        }
    }

    std::uint8_t faces_of(const std::vector<std::uint32_t>& points) const {
        std::uint8_t faces = 0;
        for (const std::uint32_t p : points) faces |= points_[p].faces;
        return faces;
    }

    // A place from which none of the points is further than the limit, after leaving out those that are too
    // far from the others. It is the points' mean, or if that is too far, nearer to the middle of the
    // smallest ball that holds them (Badoiu and Clarkson 2003). Where points lie in faces of the volume's
    // box, it does too.
    Offset find_middle(std::vector<std::uint32_t>& points) const {
        for (;;) {
            Offset middle{0, 0, 0};
            for (const std::uint32_t p : points) middle[points_[p].axis] += points_[p].offset;
            for (float& m : middle) m /= static_cast<float>(points.size());
            const std::uint8_t faces = faces_of(points);
            std::size_t furthest = 0;
            for (float step = 2; step < 10; ++step) {
                for (unsigned a = 0; a < 3; ++a) {
                    if (faces >> a & 1) middle[a] = 0;
                }
                furthest = furthest_from(middle, points);
                const Offset to = offset_of(points_[points[furthest]]);
                if (distance(middle, to) <= limit_) return middle;
                for (std::size_t a = 0; a < 3; ++a) middle[a] += (to[a] - middle[a]) / step;
            }
            points.erase(points.begin() + static_cast<std::ptrdiff_t>(furthest));
        }
    }

    std::size_t furthest_from(const Offset& middle, const std::vector<std::uint32_t>& points) const {
        std::size_t furthest = 0;
        float largest = 0;
        for (std::size_t k = 0; k < points.size(); ++k) {
            const float far = distance(middle, offset_of(points_[points[k]]));
            if (far > largest) largest = far, furthest = k;
        }
        return furthest;
    }

    void become_one(const std::vector<std::uint32_t>& points, const Offset& middle) {
        const std::uint32_t one = points.front();
        Vec3f normal{0, 0, 0};
        for (const std::uint32_t p : points) {
            joined_[p] = one;
            points_[one].moved = std::max(points_[one].moved, distance(middle, offset_of(points_[p])));
            if (mesh_.normals.empty()) continue;
            for (std::size_t r = 0; r < 3; ++r) normal[r] += mesh_.normals[p][r];
        }
        Offset step = middle;
        step[points_[one].axis] -= points_[one].offset;
        for (std::size_t r = 0; r < 3; ++r) {
            const auto& m = input_.frame.matrix[r];
            mesh_.points[one][r] += m[0] * step[0] + m[1] * step[1] + m[2] * step[2];
        }
        const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        if (length > 0) mesh_.normals[one] = {normal[0] / length, normal[1] / length, normal[2] / length};
    }

    // To the limit's distance from the sample, on its edge.
    void move_away(std::uint32_t p) {
        NearPoint& point = points_[p];
        const float offset = point.first ? limit_ : -limit_;
        if (std::abs(point.offset) >= limit_) return;
        for (std::size_t r = 0; r < 3; ++r)
            mesh_.points[p][r] += input_.frame.matrix[r][point.axis] * (offset - point.offset);
        point.moved = std::abs(offset - point.offset);
    }

    struct FlatCorner {
        std::uint32_t point;
        Vec3d step;  // from the opposite edge, in mm, to make the triangle's other angles large enough
    };

    std::optional<FlatCorner> find_flat_corner(std::uint64_t triangle) const {
        constexpr double kSlope = 0.11;  // 6.3 degrees
        const Triangle& corners = mesh_.triangles[triangle];
        std::array<Vec3d, 3> at;
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3f& point = mesh_.points[corners[c]];
            at[c] = {point[0], point[1], point[2]};
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const Vec3d &p = at[c], &a = at[(c + 1) % 3], &b = at[(c + 2) % 3];
            if (dot(a - p, b - p) >= 0) continue;
            // All but the few go without a division: with the foot of the height at `along` of |edge|^2.
            const Vec3d edge = b - a;
            const double squared = dot(edge, edge), along = dot(p - a, edge);
            const double longer = kSlope * std::max(along, squared - along);
            if (dot(p - a, p - a) * squared - along * along >= longer * longer) return std::nullopt;
            const Vec3d height = p - a - (along / squared) * edge;
            if (dot(height, height) == 0) return std::nullopt;
            const double wanted = longer / std::sqrt(squared);
            return FlatCorner{corners[c], (wanted / length(height) - 1) * height};
        }
        return std::nullopt;
    }

    void move_aside(std::uint32_t p, const Vec3d& step) {
        const Mat3d& m = input_.frame.exact;
        Vec3d edges;  // the step in edges along each axis
        for (std::size_t a = 0; a < 3; ++a) {
            edges[a] = points_[p].faces >> a & 1 ? 0 : dot(step, to_edges_[a]);
        }
        const double may = limit_ - points_[p].moved;
        if (length(edges) > may) edges = may / length(edges) * edges;
        points_[p].moved += static_cast<float>(length(edges));
        for (std::size_t r = 0; r < 3; ++r) mesh_.points[p][r] += static_cast<float>(dot(m[r], edges));
    }

    const EmitInput& input_;
    const float limit_;
    Mesh& mesh_;
    const std::uint64_t row_samples_, slice_samples_;  // of the numbers of samples
    const std::size_t slices_, blocks_;
    Mat3d to_edges_;  // the inverse of the frame's matrix
    Stage stage_;
    std::vector<std::uint64_t> samples_;  // the number in the grid of each point's nearer sample
    std::vector<NearPoint> points_;
    std::vector<std::uint32_t> joined_;  // the first of the points that a point became one with
    std::vector<std::uint32_t> first_point_;
    std::vector<std::uint64_t> first_triangle_,
        end_triangle_;  // of each slice; the end after some were taken out
};

}  // namespace

std::size_t snap(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh) {
    Snapping snapping(input, limit, progress, mesh);
    snapping.find_samples();
    snapping.join();
    snapping.take_out_collapsed();
    snapping.move_aside();
    snapping.close_up();
    report(progress, 1);
    return snapping.bytes();
}

}  // namespace marrow::internal
