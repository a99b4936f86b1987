#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/snap/cap_triangles.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include <marrow/vector.h>

#include "cap_triangles.h"
#include "slice.h"

#ifndef MARROW_FLAT_TRIANGLES_SLOPE
#define MARROW_FLAT_TRIANGLES_SLOPE
namespace marrow::internal {
namespace {
constexpr double kSlope = 0.11;  // of 6.3 degrees
}
}  // namespace marrow::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Those whose height over the longest side may be less than it should. Two sides of each are staged as they
// come, then taken apart into vectors.
void find_flat_target(const Vec3f* points, const Triangle* triangles, std::size_t count,
                      std::vector<std::uint32_t>& flat) {
    constexpr std::size_t kBatch = 64;
    const hn::CappedTag<float, 4> d4;
    const hn::CappedTag<float, 8> d;
    using V = hn::Vec<decltype(d)>;
    HWY_ALIGN float u[4 * kBatch] = {}, v[4 * kBatch] = {};
    constexpr auto kSine = static_cast<float>(1.01 * kSlope);
    const V squared_sine = hn::Set(d, kSine * kSine);
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
        const std::size_t size = std::min(kBatch, count - begin);
        for (std::size_t k = 0; k < size; ++k) {
            const auto [p, q, r] = triangles[begin + k];
            for (std::size_t i = 0; i < 4; i += hn::Lanes(d4)) {
                const auto at = hn::LoadU(d4, points[p].data() + i);
                hn::Store(hn::Sub(hn::LoadU(d4, points[q].data() + i), at), d4, u + 4 * k + i);
                hn::Store(hn::Sub(hn::LoadU(d4, points[r].data() + i), at), d4, v + 4 * k + i);
            }
        }
        for (std::size_t k = 0; k < size; k += hn::Lanes(d)) {
            V ux, uy, uz, vx, vy, vz, none;
            hn::LoadInterleaved4(d, u + 4 * k, ux, uy, uz, none);
            hn::LoadInterleaved4(d, v + 4 * k, vx, vy, vz, none);
            const auto squared = [](V x, V y, V z) HWY_ATTR {
                return hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
            };
            const auto minor = [](V a, V b, V c, V e)
                                   HWY_ATTR { return hn::Sub(hn::Mul(a, b), hn::Mul(c, e)); };
            const V uu = squared(ux, uy, uz), vv = squared(vx, vy, vz),
                    ww = squared(hn::Sub(ux, vx), hn::Sub(uy, vy), hn::Sub(uz, vz));
            const V longest = hn::Max(hn::Max(uu, vv), ww);
            const V doubled_area =
                squared(minor(uy, vz, uz, vy), minor(uz, vx, ux, vz), minor(ux, vy, uy, vx));
            const auto is_flat = hn::Lt(doubled_area, hn::Mul(squared_sine, hn::Mul(longest, longest)));
            if (HWY_LIKELY(hn::AllFalse(d, is_flat))) continue;
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, is_flat, bits);
            for (std::size_t i = 0; i < hn::Lanes(d) && k + i < size; ++i) {
                if (bits[0] >> i & 1) flat.push_back(static_cast<std::uint32_t>(begin + k + i));
            }
        }
    }
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_flat_target);

void find_flat(const Vec3f* points, const Triangle* triangles, std::size_t count,
               std::vector<std::uint32_t>& flat) {
    HWY_DYNAMIC_DISPATCH(find_flat_target)(points, triangles, count, flat);
}

namespace {

// A corner nearly on the line between the two others.
struct FlatCorner {
    std::size_t corner;
    Vec3d step;  // from the opposite edge, in mm, to make the triangle's other angles large enough
    struct End {
        std::size_t corner;
        double share;  // in the triangle's height, of a step of that corner
    };
    std::array<End, 2> ends;  // of the opposite edge, the nearer first
};

std::optional<FlatCorner> find_flat_corner(const Mesh& mesh, const Triangle& corners) {
    std::array<Vec3d, 3> at;
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec3f& point = mesh.points[corners[c]];
        at[c] = {point[0], point[1], point[2]};
    }
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec3d &p = at[c], &a = at[(c + 1) % 3], &b = at[(c + 2) % 3];
        if (dot(a - p, b - p) >= 0) continue;
        const Vec3d edge = b - a;
        const double squared = dot(edge, edge), along = dot(p - a, edge) / squared;
        const Vec3d height = p - a - along * edge;
        const double now = length(height), wanted = kSlope * std::max(along, 1 - along) * std::sqrt(squared);
        if (now >= wanted || now == 0) return std::nullopt;
        std::array<FlatCorner::End, 2> ends{{{(c + 1) % 3, 1 - along}, {(c + 2) % 3, along}}};
        if (along > 0.5) std::swap(ends[0], ends[1]);
        return FlatCorner{c, (wanted / now - 1) * height, ends};
    }
    return std::nullopt;
}

}  // namespace

void move_aside(const EmitInput& input, double limit, const std::vector<FlatTriangle>& flat, Mesh& mesh) {
    const Mat3d inverse = inverse_of(input.to_physical.exact);
    const auto& dims = input.volume.geometry.dims;
    std::unordered_map<std::uint32_t, double> moved;  // in edges, by the points that were moved here
    // Moves a point by a step in mm, as far as it may. Returns which part of the step was done.
    const auto move = [&](const FlatTriangle& triangle, std::size_t corner, const Vec3d& step) {
        const std::uint32_t p = triangle.triangle[corner];
        double& already = moved.try_emplace(p, triangle.moved[corner]).first->second;
        Vec3f& point = mesh.points[p];
        const Vec3d from_origin = Vec3d{point[0], point[1], point[2]} - input.to_physical.origin;
        Vec3d edges;
        for (std::size_t a = 0; a < 3; ++a) {
            // What lies in a face of an open volume's box stays there.
            constexpr double kNearly = 0.01;
            const double at = dot(from_origin, inverse[a]);
            const bool in_face =
                input.bits.pad == 0 && (at < kNearly || at > static_cast<double>(dims[a] - 1) - kNearly);
            edges[a] = in_face ? 0 : dot(step, inverse[a]);
        }
        const double wanted = length(edges), may = std::clamp(limit - already, 0.0, wanted);
        if (may == 0) return 0.0;
        edges = may / wanted * edges;
        already += may;
        Vec3d done;
        for (std::size_t r = 0; r < 3; ++r) {
            done[r] = dot(input.to_physical.exact[r], edges);
            point[r] += static_cast<float>(done[r]);
        }
        return dot(done, step) / dot(step, step);
    };
    constexpr int kRounds = 6;  // what one triangle gains, its neighbour can lose
    for (int round = 0; round < kRounds; ++round)
        for (const FlatTriangle& triangle : flat) {
            const auto found = find_flat_corner(mesh, triangle.triangle);
            if (!found) continue;
            double left = 1 - move(triangle, found->corner, found->step);
            // An end with little share would have to go far.
            for (const auto& [corner, share] : found->ends) {
                if (left < 0.01 || share < 0.1) break;
                left *= 1 - move(triangle, corner, -left / share * found->step);
            }
        }
}

}  // namespace marrow::internal
#endif
