// Widens cap triangles: rule 6 of docs/algorithm.md.
#include "relax_caps.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include <marrow/vector.h>

namespace marrow::internal {

namespace {

// The corner of a cap that is nearly on the line between the two others.
struct CapCorner {
    std::size_t corner;
    Vec3d step;  // moves the corner away from the opposite edge until the angles are large enough, in mm
    struct End {
        std::size_t corner;
        double weight;  // a step of this end changes the height by this multiple of it
    };
    std::array<End, 2> ends;  // of the opposite edge, the nearer first
};

std::optional<CapCorner> find_cap_corner(const Mesh& mesh, const Triangle& triangle) {
    std::array<Vec3d, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec3f& point = mesh.points[triangle[c]];
        corners[c] = {point[0], point[1], point[2]};
    }
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec3d &p = corners[c], &a = corners[(c + 1) % 3], &b = corners[(c + 2) % 3];
        if (dot(a - p, b - p) >= 0) continue;
        const Vec3d edge = b - a;
        const double squared = dot(edge, edge), along = dot(p - a, edge) / squared;
        const Vec3d height = p - a - along * edge;
        const double now = length(height),
                     wanted = kCapSlope * std::max(along, 1 - along) * std::sqrt(squared);
        if (now >= wanted || now == 0) return std::nullopt;
        std::array<CapCorner::End, 2> ends{{{(c + 1) % 3, 1 - along}, {(c + 2) % 3, along}}};
        if (along > 0.5) std::swap(ends[0], ends[1]);
        return CapCorner{c, (wanted / now - 1) * height, ends};
    }
    return std::nullopt;
}

// Inverts by Cramer's rule, with a determinant for each row. marrow::inverse() rounds differently, which
// could change the last bit of a point.
Mat3d inverse_by_rows(const Mat3d& m) {
    Mat3d result;
    for (std::size_t a = 0; a < 3; ++a) {
        const Vec3d row = cross(column(m, (a + 1) % 3), column(m, (a + 2) % 3));
        result[a] = 1 / dot(row, column(m, a)) * row;
    }
    return result;
}

// Moves points of the mesh, none of them by more than the limit.
class LimitedMover {
  public:
    LimitedMover(const EmitInput& input, double limit, Mesh& mesh)
        : input_(input), limit_(limit), mesh_(mesh), to_index_(inverse_by_rows(input.to_physical.exact)) {}

    // Moves a corner by a step in mm, as far as the limit allows. Returns the fraction of the step.
    double move(const CapTriangle& cap, std::size_t corner, const Vec3d& step) {
        const std::uint32_t p = cap.triangle[corner];
        double& moved = moved_.try_emplace(p, cap.moved[corner]).first->second;
        Vec3f& point = mesh_.points[p];
        Vec3d edges = step_in_edges(point, step);
        const double wanted = length(edges), allowed = std::clamp(limit_ - moved, 0.0, wanted);
        if (allowed == 0) return 0;
        edges = allowed / wanted * edges;
        moved += allowed;
        Vec3d done;
        for (std::size_t r = 0; r < 3; ++r) {
            done[r] = dot(input_.to_physical.exact[r], edges);
            point[r] += static_cast<float>(done[r]);
        }
        return dot(done, step) / dot(step, step);
    }

  private:
    // A point in a face of an open volume's box stays in that face.
    Vec3d step_in_edges(const Vec3f& point, const Vec3d& step) const {
        constexpr double kTolerance = 0.01;
        const Vec3d from_origin = Vec3d{point[0], point[1], point[2]} - input_.to_physical.origin;
        const auto& dims = input_.volume.geometry.dims;
        Vec3d edges;
        for (std::size_t a = 0; a < 3; ++a) {
            const double index =
                dot(from_origin, to_index_[a]) - static_cast<double>(input_.to_physical.first[a]);
            const bool in_face =
                input_.bits.first_x == 0 &&
                (index < kTolerance || index > static_cast<double>(dims[a] - 1) - kTolerance);
            edges[a] = in_face ? 0 : dot(step, to_index_[a]);
        }
        return edges;
    }

    const EmitInput& input_;
    const double limit_;
    Mesh& mesh_;
    const Mat3d to_index_;
    std::unordered_map<std::uint32_t, double> moved_;  // by point: how far it has moved, in edges
};

}  // namespace

void relax_caps(const EmitInput& input, double limit, const std::vector<CapTriangle>& caps, Mesh& mesh) {
    LimitedMover mover(input, limit, mesh);
    constexpr int kIterations = 6;  // a step that helps one triangle can harm its neighbour
    for (int iteration = 0; iteration < kIterations; ++iteration) {
        for (const CapTriangle& cap : caps) {
            const auto found = find_cap_corner(mesh, cap.triangle);
            if (!found) continue;
            double left = 1 - mover.move(cap, found->corner, found->step);
            // The ends of the opposite edge make up for the rest, unless they would have to move far.
            for (const auto& [corner, weight] : found->ends) {
                if (left < 0.01 || weight < 0.1) break;
                left *= 1 - mover.move(cap, corner, -left / weight * found->step);
            }
        }
    }
}

}  // namespace marrow::internal
