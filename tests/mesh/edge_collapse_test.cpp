// Tests that collapses are undone to the bit, and that the changes between two results are listed.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include <marrow/isosurface.h>

#include "base/parallel.h"
#include "mesh/reduction/edge_collapse.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using internal::EdgeCollapse;

Mesh bumpy_torus(const Geometry& geometry, const Vec3d& centre, double radius, double tube) {
    const auto field = torus(centre, radius, tube);
    const Volume volume = sampled_in_space<float>(
        geometry, [&](const Vec3d& p) { return field(p) + 0.3 * std::sin(2 * p[0] + p[1]); });
    Mesh mesh = extract_isosurface(volume, 0);
    mesh.normals.clear();
    return mesh;
}

Mesh bumpy_torus() {
    return bumpy_torus(grid(41, 41, 41), {20, 20, 20}, 11, 5);
}

// Large enough for several regions.
Mesh large_bumpy_torus() {
    return bumpy_torus(grid(181, 181, 81), {90, 90, 40}, 60, 28);
}

void undo_all(EdgeCollapse& collapse) {
    for (std::size_t before = 0; before != collapse.triangles();) {
        before = collapse.triangles();
        for (const std::uint32_t p : collapse.result().old_points) collapse.undo({&p, 1}, 1);
    }
}

TEST(EdgeCollapse, UndoesCollapsesToTheBit) {
    const Mesh mesh = bumpy_torus();
    EdgeCollapse collapse(mesh);
    collapse.reduce_to(mesh.triangles.size() / 10, {});
    EXPECT_EQ(manifold_fault(collapse.result().mesh), "");
    // Collapses depend on each other. So one at a time, from anywhere, meets every order of undoing.
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        const std::uint32_t at = collapse.merged_into()[p];
        collapse.undo({&at, 1}, 1);
        if (p % 500 == 0) {
            EXPECT_EQ(manifold_fault(collapse.result().mesh), "");
        }
    }
    undo_all(collapse);
    const EdgeCollapse::Result all = collapse.result();
    EXPECT_EQ(all.mesh.points, mesh.points);
    EXPECT_EQ(all.mesh.triangles, mesh.triangles);
}

TEST(EdgeCollapse, HoldsThePointsOfUndoneCollapses) {
    const Mesh mesh = bumpy_torus();
    EdgeCollapse collapse(mesh);
    collapse.reduce_to(mesh.triangles.size() / 2, {});
    undo_all(collapse);
    EXPECT_EQ(collapse.triangles(), mesh.triangles.size());
    collapse.reduce_to(0, {});
    const EdgeCollapse::Result result = collapse.result();
    EXPECT_GT(result.mesh.triangles.size(), mesh.triangles.size() / 10);
    EXPECT_LT(result.mesh.triangles.size(), mesh.triangles.size());
}

TEST(EdgeCollapse, CollapsesRegionsTheSameWayOnAnyNumberOfThreads) {
    const Mesh mesh = large_bumpy_torus();
    ASSERT_GT(mesh.points.size(), 100'000u);
    const auto reduced = [&](int threads, std::size_t triangles) {
        EdgeCollapse::Result result;
        internal::with_threads(threads, [&] {
            EdgeCollapse collapse(mesh);
            collapse.reduce_to(triangles, {});
            result = collapse.result();
        });
        return result;
    };
    for (const std::size_t triangles :
         {mesh.triangles.size() / 2, mesh.triangles.size() / 10, std::size_t{500}}) {
        const EdgeCollapse::Result one = reduced(1, triangles);
        EXPECT_EQ(manifold_fault(one.mesh), "");
        EXPECT_EQ(one.mesh.triangles.size(), triangles / 2 * 2);
        for (const int threads : {0, 3}) {
            const EdgeCollapse::Result more = reduced(threads, triangles);
            EXPECT_EQ(more.mesh.points, one.mesh.points);
            EXPECT_EQ(more.mesh.triangles, one.mesh.triangles);
            EXPECT_EQ(more.old_points, one.old_points);
        }
    }
}

TEST(EdgeCollapse, UndoesCollapsesOfRegionsToTheBit) {
    const Mesh mesh = large_bumpy_torus();
    EdgeCollapse collapse(mesh);
    collapse.reduce_to(mesh.triangles.size() / 10, {});
    const auto merged_into = collapse.merged_into();
    for (const std::uint32_t p : collapse.result().old_points) EXPECT_EQ(merged_into[p], p);
    undo_all(collapse);
    const EdgeCollapse::Result all = collapse.result();
    EXPECT_EQ(all.mesh.points, mesh.points);
    EXPECT_EQ(all.mesh.triangles, mesh.triangles);
}

// The edges inside of regions that are still queued must not be forgotten when one
// thread goes on with all edges.
TEST(EdgeCollapse, GoesOnAfterRegionsToTheWantedNumber) {
    struct AcceptAll : internal::CollapseGuard {
        bool accept(std::span<const std::uint32_t>, std::span<const internal::PatchTriangle>) override {
            return true;
        }
    } guard;
    const Mesh mesh = large_bumpy_torus();
    EdgeCollapse guarded(mesh), undone(mesh);
    for (EdgeCollapse* collapse : {&guarded, &undone}) collapse->reduce_to(mesh.triangles.size() / 10, {});
    guarded.set_guard(&guard);
    guarded.reduce_to(150, {});
    EXPECT_EQ(guarded.triangles(), 150u);
    const std::uint32_t corner = undone.result().old_points[0];
    EXPECT_GT(undone.undo(std::array{corner}, 1), 0u);
    undone.reduce_to(150, {});
    EXPECT_EQ(undone.triangles(), 150u);
}

TEST(EdgeCollapse, ListsTheTrianglesThatChanged) {
    const Mesh mesh = bumpy_torus();
    EdgeCollapse collapse(mesh);
    EXPECT_TRUE(collapse.result().changed.empty());
    // A triangle by its points in the original mesh and their positions.
    using Key = std::array<std::pair<std::uint32_t, std::array<float, 3>>, 3>;
    const auto keys = [](const EdgeCollapse::Result& result) {
        std::vector<Key> keys;
        for (const Triangle& t : result.mesh.triangles) {
            Key& key = keys.emplace_back();
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3f& p = result.mesh.points[t[c]];
                key[c] = {result.old_points[t[c]], {p[0], p[1], p[2]}};
            }
            std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
        }
        return keys;
    };
    std::vector<Key> before = keys(collapse.result());
    for (const double share : {0.95, 0.9, 0.5, 0.2}) {
        collapse.reduce_to(static_cast<std::size_t>(share * static_cast<double>(mesh.triangles.size())), {});
        for (const std::uint32_t p : {500u, 1500u, 2500u}) {
            const std::uint32_t at = collapse.merged_into()[p];
            collapse.undo({&at, 1}, 3);
        }
        const EdgeCollapse::Result result = collapse.result();
        const std::vector<Key> now = keys(result);
        const std::set<Key> known(before.begin(), before.end());
        const std::set<std::uint32_t> changed(result.changed.begin(), result.changed.end());
        EXPECT_LT(result.changed.size(), (share > 0.9 ? 0.5 : 1.01) * static_cast<double>(now.size()));
        for (std::uint32_t t = 0; t < now.size(); ++t) {
            if (!known.contains(now[t])) {
                EXPECT_TRUE(changed.contains(t)) << t << " at " << share;
            }
        }
        before = now;
    }
}

TEST(EdgeCollapse, KnowsWhereEachPointWent) {
    const Mesh mesh = bumpy_torus();
    EdgeCollapse collapse(mesh);
    collapse.reduce_to(mesh.triangles.size() / 10, {});
    const EdgeCollapse::Result result = collapse.result();
    const std::set<std::uint32_t> left(result.old_points.begin(), result.old_points.end());
    const auto merged_into = collapse.merged_into();
    std::map<std::uint32_t, int> merged;
    for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
        ASSERT_TRUE(left.contains(merged_into[p]));
        EXPECT_EQ(merged_into[p] == p, left.contains(p));
        ++merged[merged_into[p]];
    }
    EXPECT_EQ(merged.size(), left.size());
}

}  // namespace
}  // namespace marrow::test
