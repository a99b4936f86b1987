// Surfaces of random grids are closed manifolds with the topology of the samples, which is computed
// independently.
#include <gtest/gtest.h>

#include <set>

#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include "core/grid/threshold.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

const IsosurfaceOptions kClosed{.closed = true, .threads = 1};

// The samples as a digital solid, with a layer of outside samples around them.
class DigitalSolid {
  public:
    DigitalSolid(const Volume& volume, double isovalue) {
        const auto& dims = volume.geometry().dims;
        for (std::size_t a = 0; a < 3; ++a) n_[a] = static_cast<int>(dims[a]) + 2;
        inside_.assign(static_cast<std::size_t>(n_[0] * n_[1] * n_[2]), false);
        visit_sample_type(volume.type(), [&](auto sample) {
            using T = decltype(sample);
            const auto* samples = volume.samples<T>();
            for (int z = 1; z + 1 < n_[2]; ++z) {
                for (int y = 1; y + 1 < n_[1]; ++y) {
                    for (int x = 1; x + 1 < n_[0]; ++x, ++samples) {
                        inside_[index(x, y, z)] =
                            std::isfinite(static_cast<double>(*samples)) && *samples >= isovalue;
                    }
                }
            }
        });
    }

    // Components of the inside (connected across faces of voxels) or of the outside (across edges too).
    int components(bool of_inside) const {
        std::vector<bool> seen(inside_.size(), false);
        int components = 0;
        for_each([&](int x, int y, int z) {
            if (inside_[index(x, y, z)] != of_inside || seen[index(x, y, z)]) return;
            ++components;
            std::vector<std::array<int, 3>> open{{x, y, z}};
            seen[index(x, y, z)] = true;
            while (!open.empty()) {
                const auto p = open.back();
                open.pop_back();
                for (int d = 0; d < 27; ++d) {
                    const int dx = d % 3 - 1, dy = d / 3 % 3 - 1, dz = d / 9 - 1;
                    const int steps = std::abs(dx) + std::abs(dy) + std::abs(dz);
                    if (steps == 0 || steps > (of_inside ? 1 : 2)) continue;
                    const int qx = p[0] + dx, qy = p[1] + dy, qz = p[2] + dz;
                    if (qx < 0 || qy < 0 || qz < 0 || qx >= n_[0] || qy >= n_[1] || qz >= n_[2]) continue;
                    const std::size_t q = index(qx, qy, qz);
                    if (inside_[q] != of_inside || seen[q]) continue;
                    seen[q] = true;
                    open.push_back({qx, qy, qz});
                }
            }
        });
        return components;
    }

    // The Euler characteristic of the solid: samples - edges + faces - cells that are completely inside, and
    // one more for every cell with two antipodal outside corners and six inside ones: there the surface
    // closes the ring of inside corners by a disc on each side.
    int euler_characteristic() const {
        int chi = 0;
        for_each([&](int x, int y, int z) {
            for (int extent = 0; extent < 8; ++extent) {  // the axes along which the element extends
                const int ex = extent & 1, ey = extent >> 1 & 1, ez = extent >> 2;
                if (x + ex >= n_[0] || y + ey >= n_[1] || z + ez >= n_[2]) continue;
                int inside = 0, mask = 0;
                for (int v = 0; v < 8; ++v) {
                    if (v & ~extent) continue;
                    const bool in = inside_[index(x + (v & 1), y + (v >> 1 & 1), z + (v >> 2))];
                    inside += in;
                    mask |= in << v;
                }
                const int axes = ex + ey + ez;
                if (inside == 1 << axes) chi += axes % 2 == 0 ? 1 : -1;
                if (extent == 7) {
                    for (int v = 0; v < 4; ++v) chi += mask == (255 & ~(1 << v | 1 << (7 - v)));
                }
            }
        });
        return chi;
    }

  private:
    std::size_t index(int x, int y, int z) const {
        return static_cast<std::size_t>((z * n_[1] + y) * n_[0] + x);
    }
    template <class F>
    void for_each(const F& f) const {
        for (int z = 0; z < n_[2]; ++z) {
            for (int y = 0; y < n_[1]; ++y) {
                for (int x = 0; x < n_[0]; ++x) f(x, y, z);
            }
        }
    }

    std::array<int, 3> n_;
    std::vector<bool> inside_;
};

class RandomGrids : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, RandomGrids, testing::Range(0, 10));

// 10 x 10,000 grids.
TEST_P(RandomGrids, CappedSurfaceIsAClosedManifoldOfTheSolidsTopology) {
    Random random(static_cast<std::uint64_t>(GetParam()));
    for (int i = 0; i < 10000; ++i) {
        const RandomGrid g = random_grid(random);
        const Mesh mesh = extract_isosurface(g.volume, g.isovalue, kClosed);
        ASSERT_EQ(manifold_fault(mesh), "") << "grid " << i;
        for (const auto* vectors : {&mesh.points, &mesh.normals}) {
            for (const Vec3f& v : *vectors) ASSERT_TRUE(std::isfinite(v[0] + v[1] + v[2])) << "grid " << i;
        }
        const DigitalSolid solid(g.volume, g.isovalue);
        const MeshMeasures m = measure(mesh);
        ASSERT_EQ(m.euler_characteristic, 2 * solid.euler_characteristic()) << "grid " << i;
        // Inside and outside regions form a tree whose edges are the components of the surface.
        ASSERT_EQ(m.components, solid.components(true) + solid.components(false) - 1) << "grid " << i;
        ASSERT_EQ(m.boundary_edges, 0);
        ASSERT_EQ(m.nonmanifold_edges, 0);
    }
}

TEST_P(RandomGrids, TrianglesAreExactlyTheClassicAlgorithms) {
    Random random(static_cast<std::uint64_t>(1000 + GetParam()));
    for (int i = 0; i < 1000; ++i) {
        const RandomGrid g = random_grid(random);
        for (const bool closed : {false, true}) {
            const Mesh mesh = extract_isosurface(g.volume, g.isovalue, {.closed = closed, .threads = 1});
            const Mesh classic = extract_isosurface_classic(g.volume, g.isovalue, closed);
            ASSERT_EQ(triangle_positions(mesh), triangle_positions(classic)) << "grid " << i;
            ASSERT_EQ(manifold_fault(mesh, !closed), "") << "grid " << i;
        }
    }
}

// Small integers, so that many samples equal the isovalue.
TEST_P(RandomGrids, PointsAtTiesAreDistinctAndTrianglesHaveArea) {
    Random random(static_cast<std::uint64_t>(2000 + GetParam()));
    for (int i = 0; i < 1000; ++i) {
        const Volume volume = sampled<std::int16_t>(grid(2 + i % 7, 2 + i / 7 % 7, 5),
                                                    [&](auto, auto, auto) { return random() % 4; });
        const Mesh mesh = extract_isosurface(volume, 2, kClosed);
        ASSERT_EQ(manifold_fault(mesh), "") << "grid " << i;
        std::set<PointBits> positions;
        for (const Vec3f& p : mesh.points) ASSERT_TRUE(positions.insert(bits_of(p)).second) << "grid " << i;
        for (const Triangle& t : mesh.triangles) {
            Vec3d corner[3];
            for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t r = 0; r < 3; ++r) corner[c][r] = static_cast<double>(mesh.points[t[c]][r]);
            const Vec3d twice_area = cross(corner[1] - corner[0], corner[2] - corner[0]);
            ASSERT_GT(dot(twice_area, twice_area), 0) << "grid " << i;
        }
    }
}

TEST(Topology, NamedPathologies) {
    for (std::int64_t n : {2, 3, 8, 65}) {
        for (const Volume& volume : {checkerboard(n), one_voxel_thick_wall(n)}) {
            for (const double isovalue : {0.5, 1.0, 500.0, 1000.0}) {
                const Mesh mesh = extract_isosurface(volume, isovalue, kClosed);
                EXPECT_EQ(manifold_fault(mesh), "");
            }
        }
    }
    const Volume volume = one_voxel_thick_wall(20);
    const Mesh wall = extract_isosurface(volume, 500.0, kClosed);
    EXPECT_EQ(measure(wall).components, 1);
    EXPECT_EQ(measure(wall).euler_characteristic, 2);
}

TEST(Topology, OpenBorderLiesOnTheVolumesBox) {
    const Volume volume = sampled_in_space<float>(grid(20, 21, 22), sphere({2, 19, 10}, 8));
    const Mesh mesh = extract_isosurface(volume, 0);
    ASSERT_EQ(manifold_fault(mesh, true), "");
    EXPECT_GT(measure(mesh).boundary_edges, 0);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : mesh.triangles) {
        for (std::size_t c = 0; c < 3; ++c) ++edges[std::minmax(t[c], t[(c + 1) % 3])];
    }
    for (const auto& [edge, triangles] : edges) {
        if (triangles != 1) continue;
        for (const std::uint32_t p : {edge.first, edge.second}) {
            bool on_box = false;
            for (std::size_t a = 0; a < 3; ++a) {
                on_box |= mesh.points[p][a] == 0 ||
                          mesh.points[p][a] == static_cast<float>(volume.geometry().dims[a] - 1);
            }
            EXPECT_TRUE(on_box);
        }
    }
}

}  // namespace
}  // namespace marrow::test
