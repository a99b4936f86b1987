// Snapping joins points of the finished surface, after SnapMC (Raman and Wenger 2008), with two differences:
// the joined point lies amid the points that it is made of instead of at the sample, so that the surface
// stays where it is; and every joining is checked on the surface itself, so that it stays a manifold whatever
// the samples.
//
// 1. Every point belongs to the nearer end of its edge; those of a sample that hang together, one of them
//    near, are a crowd.
// 2. Crowds become one point each, all at the same time, but those whose rim would not be simple then: their
//    points are moved away from the sample instead, where they are too close to it.
// 3. What is left moves together and is numbered anew; triangles that collapsed are left out.
// 4. A point that lies nearly on the line between the two others of a triangle is moved aside.
//
// Whether a crowd may join is asked with all others joined. That is enough if not all do: a rim that is simple
// now and with all joined is so with any of them. So no order matters, and slabs of slices go to threads.
#include "snap.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <vector>

#include <marrow/vector.h>

#include "crowds.h"
#include "fan.h"
#include "pipeline.h"

namespace marrow::internal {

namespace {

// A triangle with a point nearly on the line between the others; and as it was before any joined.
struct FlatTriangle {
    Triangle triangle, before;
};

struct Slab {
    std::size_t begin, end;  // slices
    std::uint32_t first_crowd;
    std::vector<Crowd> crowds;            // round the samples of these slices
    std::vector<std::size_t> slice_ends;  // in crowds
    std::uint32_t points = 0;             // that are left of these slices'
    std::uint64_t triangles = 0;          // also
    std::vector<FlatTriangle> flat;
};

constexpr std::uint32_t kNoCrowd = ~std::uint32_t{0};

class Snapping {
  public:
    Snapping(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh)
        : input_(input),
          limit_(static_cast<float>(limit)),
          mesh_(mesh),
          joined_(mesh.points.size()),
          crowd_of_(mesh.points.size()) {
        const auto slices = static_cast<std::size_t>(input.bits.nz);
        for (std::size_t z = 0; z <= slices; ++z) {
            const std::size_t row = input.bits.row_index(0, static_cast<std::int64_t>(z));
            first_point_.push_back(static_cast<std::uint32_t>(input.points.first_output(row)));
            first_triangle_.push_back(input.triangles.first_output(row));
        }
        const std::size_t slab_slices = std::clamp<std::size_t>(slices / (share_count() / 2), 8, 64);
        std::uint32_t crowds = 0;  // at most: they have two points or more, in the slab and the slice before
        for (std::size_t z = 0; z < slices; z += slab_slices) {
            Slab& slab = slabs_.emplace_back();
            slab.begin = z;
            slab.end = std::min(z + slab_slices, slices);
            slab.first_crowd = crowds;
            crowds += (first_point_[slab.end] - first_point_[z > 0 ? z - 1 : 0]) / 2;
        }
        constexpr std::size_t kParallelStages = 6;
        stage_.emplace(progress, 0.6, 1, kParallelStages * slabs_.size());

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
        std::size_t crowds = 0;
        for (const Slab& slab : slabs_) crowds += slab.crowds.size();
        return crowds * sizeof(Crowd) + joined_.size() * (sizeof joined_[0] + sizeof crowd_of_[0]);
    }

    void run() {
        for_each_slab([&](Slab& slab) { set_apart(slab); });
        for_each_slab([&](Slab& slab) { find(slab); });
        for_each_slab([&](Slab& slab) { check(slab); });
        for_each_slab([&](Slab& slab) { settle(slab); });
        for_each_slab([&](Slab& slab) { close_up_points(slab); });
        number_points();
        for_each_slab([&](Slab& slab) { close_up_triangles(slab); });
        gather_triangles();
        move_aside();
    }

  private:
    template <class F>
    void for_each_slab(const F& f) {
        tbb::parallel_for(std::size_t{0}, slabs_.size(), [&](std::size_t s) {
            f(slabs_[s]);
            stage_->step();
        });
    }

    std::uint32_t first_point(const Slab& slab) const { return first_point_[slab.begin]; }
    std::uint32_t end_point(const Slab& slab) const { return first_point_[slab.end]; }

    // At first no point has joined another.
    void set_apart(const Slab& slab) {
        const auto begin = static_cast<std::ptrdiff_t>(first_point(slab)),
                   end = static_cast<std::ptrdiff_t>(end_point(slab));
        std::iota(joined_.begin() + begin, joined_.begin() + end, first_point(slab));
        std::fill(crowd_of_.begin() + begin, crowd_of_.begin() + end, kNoCrowd);
    }

    void find(Slab& slab) {
        slab.crowds.reserve((end_point(slab) - first_point(slab)) / 2);
        find_crowds(input_, limit_, mesh_.points.data(), slab.begin, slab.end, slab.crowds, slab.slice_ends);
        std::uint32_t number = slab.first_crowd;
        for (const Crowd& crowd : slab.crowds) {
            for (std::size_t k = 0; k < crowd.joining; ++k) joined_[crowd.points[k]] = crowd.points[0];
            for (std::size_t k = 0; k < crowd.joining; ++k) crowd_of_[crowd.points[k]] = number;
            ++number;
        }
    }

    // Collects the rims of a slab's crowds, and says of those that are not simple that they do not join. The
    // triangles round a slice's crowds are in the layers of cells before and behind it.
    void check(Slab& slab) {
        const auto crowds_end = [&](std::size_t z) {
            return z < slab.begin ? 0 : slab.slice_ends[z - slab.begin];
        };
        std::vector<Fan> fans(1);
        std::size_t first = 0;  // crowd that fans are for
        for (std::size_t z = slab.begin == 0 ? 0 : slab.begin - 1; z < slab.end; ++z) {
            const std::size_t count = crowds_end(std::min(z + 1, slab.end - 1)) - first;
            fans.resize(count + 1);  // the last for points that are in none of them
            collect(z, slab.first_crowd + static_cast<std::uint32_t>(first),
                    static_cast<std::uint32_t>(count), fans.data());
            fans.pop_back();
            if (z < slab.begin) continue;
            const std::size_t done = crowds_end(z) - first;
            for (std::size_t k = 0; k < done; ++k) {
                Crowd& crowd = slab.crowds[first + k];
                if (!fans[k].is_simple(joined_.data(), crowd.faces != 0)) crowd.joining = 0;
            }
            fans.erase(fans.begin(), fans.begin() + static_cast<std::ptrdiff_t>(done));
            first += done;
        }
    }

    // Adds the triangles of a layer of cells to the fans of `count` crowds from the number `first` on; what
    // is in none of them to one fan more.
    void collect(std::size_t layer, std::uint32_t first, std::uint32_t count, Fan* fans) const {
        for (std::uint64_t t = first_triangle_[layer]; t < first_triangle_[layer + 1]; ++t) {
            const auto [p, q, r] = mesh_.triangles[t];
            const std::uint32_t a = std::min(crowd_of_[p] - first, count),
                                b = std::min(crowd_of_[q] - first, count),
                                c = std::min(crowd_of_[r] - first, count);
            fans[a].add(q, r, (a != b) & (a != c));
            fans[b].add(r, p, (b != c) & (b != a));
            fans[c].add(p, q, (c != a) & (c != b));
        }
    }

    // Moves the points of the crowds: those that join, the first of them; others away from the sample.
    void settle(Slab& slab) {
        std::uint32_t number = slab.first_crowd;
        for (const Crowd& crowd : slab.crowds) {
            if (crowd.joining != 0) {
                become_one(crowd);
            } else {
                for (std::size_t k = 0; k < crowd.size; ++k) {
                    joined_[crowd.points[k]] = crowd.points[k];
                    crowd_of_[crowd.points[k]] = number;
                    move_away(crowd, k);
                }
            }
            ++number;
        }
    }

    void become_one(const Crowd& crowd) {
        const std::uint32_t one = crowd.points[0];
        Vec3f step = crowd.middle;
        step[crowd.axes[0]] -= crowd.offsets[0];
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3f& m = input_.frame.matrix[r];
            mesh_.points[one][r] += m[0] * step[0] + m[1] * step[1] + m[2] * step[2];
        }
        if (mesh_.normals.empty()) return;
        Vec3f normal{0, 0, 0};
        for (std::size_t k = 0; k < crowd.joining; ++k) {
            for (std::size_t r = 0; r < 3; ++r) normal[r] += mesh_.normals[crowd.points[k]][r];
        }
        const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        if (length > 0) mesh_.normals[one] = {normal[0] / length, normal[1] / length, normal[2] / length};
    }

    // A point to the limit's distance from the sample, on its edge.
    void move_away(const Crowd& crowd, std::size_t k) {
        const float offset = crowd.offsets[k];
        if (std::abs(offset) >= limit_) return;
        const float step = std::copysign(limit_, offset) - offset;
        for (std::size_t r = 0; r < 3; ++r)
            mesh_.points[crowd.points[k]][r] += input_.frame.matrix[r][crowd.axes[k]] * step;
    }

    // Moves the points that are left to the front of the slab's.
    void close_up_points(Slab& slab) {
        const std::uint32_t begin = first_point(slab), end = end_point(slab);
        std::uint32_t to = begin;
        if (mesh_.normals.empty()) {
            for (std::uint32_t p = begin; p < end; ++p) {
                mesh_.points[to] = mesh_.points[p];
                to += joined_[p] == p;
            }
        } else {
            for (std::uint32_t p = begin; p < end; ++p) {
                mesh_.points[to] = mesh_.points[p];
                mesh_.normals[to] = mesh_.normals[p];
                to += joined_[p] == p;
            }
        }
        slab.points = to - begin;
    }

    // Moves the slabs' points together, and numbers them: joined_ then has the new numbers.
    void number_points() {
        std::uint32_t number = 0;
        for (const Slab& slab : slabs_) {
            move_down(mesh_.points, first_point(slab), number, slab.points);
            if (!mesh_.normals.empty()) move_down(mesh_.normals, first_point(slab), number, slab.points);
            for (std::uint32_t p = first_point(slab); p < end_point(slab); ++p) {
                const bool is_left = joined_[p] == p;
                joined_[p] = is_left ? number : joined_[p];
                number += is_left;
            }
        }
        for (const Slab& slab : slabs_) {
            for (const Crowd& crowd : slab.crowds) {
                for (std::size_t k = 1; k < crowd.joining; ++k)
                    joined_[crowd.points[k]] = joined_[crowd.points[0]];
            }
        }
        mesh_.points.resize(number);
        if (!mesh_.normals.empty()) mesh_.normals.resize(number);
    }

    template <class Elements>
    static void move_down(Elements& elements, std::uint64_t from, std::uint64_t to, std::uint64_t count) {
        if (from == to) return;
        const auto first = elements.begin() + static_cast<std::ptrdiff_t>(from);
        std::copy(first, first + static_cast<std::ptrdiff_t>(count),
                  elements.begin() + static_cast<std::ptrdiff_t>(to));
    }

    // Moves the triangles that are left to the front of the slab's. A batch at a time, without branches that
    // depend on the triangles: they could not be foreseen.
    void close_up_triangles(Slab& slab) {
        std::array<Triangle, kBatch> left, before;
        Triangle* to = mesh_.triangles.data() + first_triangle_[slab.begin];
        const Triangle *from = to, *const end = mesh_.triangles.data() + first_triangle_[slab.end];
        while (from < end) {
            std::size_t count = 0;
            for (const Triangle* const stop = from + std::min<std::ptrdiff_t>(end - from, kBatch);
                 from < stop; ++from) {
                const auto [p, q, r] = *from;
                const std::uint32_t a = joined_[p], b = joined_[q], c = joined_[r];
                before[count] = {p, q, r};
                left[count] = {a, b, c};
                count += (a != b) & (b != c) & (c != a);
            }
            to = std::copy_n(left.begin(), count, to);
            find_flat(left, before, count, slab.flat);
        }
        slab.triangles =
            static_cast<std::uint64_t>(to - (mesh_.triangles.data() + first_triangle_[slab.begin]));
    }

    void gather_triangles() {
        std::uint64_t end = 0;
        for (const Slab& slab : slabs_) {
            move_down(mesh_.triangles, first_triangle_[slab.begin], end, slab.triangles);
            end += slab.triangles;
        }
        mesh_.triangles.resize(end);
    }

    static constexpr std::size_t kBatch = 64;  // triangles

    // Lists those of the first `count` whose height over the longest side may be less than it should.
    void find_flat(const std::array<Triangle, kBatch>& triangles, const std::array<Triangle, kBatch>& before,
                   std::size_t count, std::vector<FlatTriangle>& flat) const {
        std::array<std::array<float, kBatch>, 3> u, v;  // two sides
        for (std::size_t k = 0; k < count; ++k) {
            const Vec3f &a = mesh_.points[triangles[k][0]], &b = mesh_.points[triangles[k][1]],
                        &c = mesh_.points[triangles[k][2]];
            for (std::size_t r = 0; r < 3; ++r) {
                u[r][k] = b[r] - a[r];
                v[r][k] = c[r] - a[r];
            }
        }
        constexpr auto kSine = static_cast<float>(1.01 * kSlope);
        std::array<float, kBatch> excess;
        for (std::size_t k = 0; k < count; ++k) {
            const float ux = u[0][k], uy = u[1][k], uz = u[2][k], vx = v[0][k], vy = v[1][k], vz = v[2][k];
            const float wx = ux - vx, wy = uy - vy, wz = uz - vz;
            const float uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz,
                        ww = wx * wx + wy * wy + wz * wz;
            const float longer = uu > vv ? uu : vv, longest = longer > ww ? longer : ww;
            const float x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
            excess[k] = x * x + y * y + z * z - kSine * kSine * (longest * longest);
        }
        for (std::size_t k = 0; k < count; ++k) {
            if (excess[k] < 0) flat.push_back({triangles[k], before[k]});
        }
    }

    static constexpr double kSlope = 0.11;  // 6.3 degrees

    struct FlatCorner {
        std::size_t corner;
        Vec3d step;  // from the opposite edge, in mm, to make the triangle's other angles large enough
    };

    std::optional<FlatCorner> find_flat_corner(const Triangle& corners) const {
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
            return FlatCorner{c, (wanted / length(height) - 1) * height};
        }
        return std::nullopt;
    }

    // Moves points aside that lie nearly on the line between the others of a triangle, as far as they may
    // still move.
    void move_aside() {
        std::unordered_map<std::uint32_t, double> moved;  // in edges, by the points that were moved aside
        for (const Slab& slab : slabs_) {
            for (const FlatTriangle& flat : slab.flat) {
                const auto corner = find_flat_corner(flat.triangle);
                if (!corner) continue;
                const std::uint32_t p = flat.triangle[corner->corner], before = flat.before[corner->corner];
                const Past past = past_of(before, mesh_.points[p]);
                double& already = moved.try_emplace(p, past.moved).first->second;
                Vec3d edges;  // the step in edges along each axis
                for (std::size_t a = 0; a < 3; ++a)
                    edges[a] = past.faces >> a & 1 ? 0 : dot(corner->step, to_edges_[a]);
                const double may = limit_ - already;
                if (length(edges) > may) edges = may / length(edges) * edges;
                already += length(edges);
                for (std::size_t r = 0; r < 3; ++r)
                    mesh_.points[p][r] += static_cast<float>(dot(input_.frame.exact[r], edges));
            }
        }
    }

    // How far a point was moved, in edges, and in which faces of an open volume's box it has to stay.
    struct Past {
        double moved;
        std::uint32_t faces;
    };
    // Of a point that was made as `before`.
    Past past_of(std::uint32_t before, const Vec3f& at) const {
        if (crowd_of_[before] == kNoCrowd) return {0, faces_of(before, at)};
        const auto behind = std::upper_bound(
            slabs_.begin(), slabs_.end(), crowd_of_[before],
            [](std::uint32_t number, const Slab& slab) { return number < slab.first_crowd; });
        const Slab& slab = *(behind - 1);
        const Crowd& crowd = slab.crowds[crowd_of_[before] - slab.first_crowd];
        if (crowd.joining != 0) return {crowd.moved, crowd.faces};
        const auto k = std::find(crowd.points.begin(), crowd.points.end(), before) - crowd.points.begin();
        const float offset = crowd.offsets[static_cast<std::size_t>(k)];
        return {std::max(limit_ - std::abs(offset), 0.0f), faces_of(before, at)};
    }

    std::uint32_t faces_of(std::uint32_t point, const Vec3f& at) const {
        if (input_.bits.pad != 0) return 0;
        const auto [row, rank] = input_.points.locate(point);
        const std::uint32_t along_x = input_.along_x[row], along_y = input_.along_y[row];
        const std::size_t axis = rank < along_x ? 0 : rank < along_x + along_y ? 1 : 2;
        const Vec3d from_origin = Vec3d{at[0], at[1], at[2]} - input_.frame.origin;
        std::uint32_t faces = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            if (a == axis) continue;
            const auto index = std::llround(dot(from_origin, to_edges_[a]));
            if (index <= 0 || index + 1 >= input_.volume.geometry.dims[a]) faces |= 1u << a;
        }
        return faces;
    }

    const EmitInput& input_;
    const float limit_;
    Mesh& mesh_;
    Mat3d to_edges_;  // the inverse of the frame's matrix
    std::optional<Stage> stage_;
    std::vector<std::uint32_t> first_point_;  // by slice
    std::vector<std::uint64_t> first_triangle_;
    std::vector<Slab> slabs_;
    Buffer<std::uint32_t> joined_;    // the first of the points that a point becomes one with
    Buffer<std::uint32_t> crowd_of_;  // the number of its crowd, if that can join or was moved away
};

}  // namespace

std::size_t snap(const EmitInput& input, double limit, const Progress& progress, Mesh& mesh) {
    Snapping snapping(input, limit, progress, mesh);
    snapping.run();
    report(progress, 1);
    return snapping.bytes();
}

}  // namespace marrow::internal
