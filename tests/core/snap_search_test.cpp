// Tests the search for self-intersections of snapped surfaces against the search of any mesh, and slices that
// are made again against surfaces that are made at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include <marrow/isosurface.h>

#include "core/grid/index_to_physical.h"
#include "core/marching_cubes/classify.h"
#include "core/marching_cubes/count.h"
#include "core/snap/find_intersections.h"
#include "core/snap/surface.h"
#include "mesh/connectivity/one_rings.h"
#include "mesh/intersections/self_intersections.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using namespace internal;

// The passes before emission.
class Counted {
  public:
    Counted(const VolumeView& volume, double isovalue, bool closed)
        : volume_(volume),
          to_physical_(volume_),
          bits_(volume.geometry.dims, ClosedSides::all(closed)),
          active_(bits_),
          rows_(bits_.rows()) {
        for (std::int64_t z = 0; z < bits_.nz; ++z) classify_slice(volume_, isovalue, z, bits_, nullptr);
        count_rows(bits_, 0, bits_.rows(), rows_, active_);
        count_triangles(bits_, 0, bits_.rows(), rows_);
        points_.emplace(rows_.points);
        triangles_.emplace(rows_.triangles);
        input_.emplace(EmitInput{volume_, isovalue, to_physical_, bits_, active_, *points_, *triangles_,
                                 rows_.along_x, rows_.along_y});
    }
    const EmitInput& input() const { return *input_; }

  private:
    const VolumeView volume_;
    const IndexToPhysical to_physical_;
    InsideBits bits_;
    ActiveWords active_;
    RowCounts rows_;
    std::optional<HistoPyramid> points_, triangles_;
    std::optional<EmitInput> input_;
};

SnapOutput surface_of(const EmitInput& input, const SnapExceptions& exceptions, double limit) {
    SnapOutput surface;
    make_surface(input, exceptions, static_cast<float>(limit), true, {}, surface);
    return surface;
}

// Moves some of the points by at most `most` along each axis of the grid.
void shake(const IndexToPhysical& to_physical, double most, Random& random, Mesh& mesh) {
    std::uniform_real_distribution<double> by(-most, most);
    for (Vec3f& p : mesh.points) {
        if (random() % 3 != 0) continue;
        const Vec3d edges{by(random), by(random), by(random)};
        for (std::size_t r = 0; r < 3; ++r) p[r] += static_cast<float>(dot(to_physical.exact[r], edges));
    }
}

Geometry any_geometry(const Geometry& g, Random& random) {
    Geometry changed = g;
    switch (random() % 4) {
        case 0:
            changed.spacing = {0.4, 0.5, 3};
            changed.origin = {-900, 800, 1200};
            changed.direction = {{{1, 0, 0}, {0, 1, 0.316}, {0, 0, 0.949}}};
            break;
        case 1:
            changed.direction = {{{-1, 0, 0}, {0, 0.6, 0.8}, {0, -0.8, 0.6}}};
            break;
        case 2:
            // Rounding is so coarse here that more than neighbours must be compared.
            changed.origin = {1e6, 0, 0};
            break;
        default:
            break;
    }
    return changed;
}

class SnapSearch : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, SnapSearch, testing::Range(0, 8));

TEST_P(SnapSearch, FindsWhatTheSearchOfAnyMeshFinds) {
    Random random(static_cast<std::uint64_t>(GetParam()));
    std::size_t found = 0;
    for (int i = 0; i < 150; ++i) {
        const RandomGrid g = random_grid(random);
        VolumeView volume(g.volume);
        volume.geometry = any_geometry(volume.geometry, random);
        for (const bool closed : {true, false}) {
            const Counted counted(volume, g.isovalue, closed);
            const EmitInput& input = counted.input();
            for (const double limit : {0.05, 0.3, 0.45}) {
                SnapOutput surface = surface_of(input, SnapExceptions(input), limit);
                const double room = 0.48 - limit;
                if (i % 2 == 1) shake(input.to_physical, room, random, surface.mesh);
                const std::vector<std::uint8_t> layers(surface.slices(), 1);
                const std::vector<TrianglePair> expected =
                    find_self_intersections(surface.mesh, OneRings(surface.mesh));
                ASSERT_EQ(find_intersections(input, 0.48, surface, layers, {}, 0, 1), expected)
                    << "grid " << i << " limit " << limit << closed;
                found += expected.size();
            }
        }
    }
    EXPECT_GT(found, 2000u);
}

TEST_P(SnapSearch, FindsAllInMarkedLayers) {
    Random random(static_cast<std::uint64_t>(100 + GetParam()));
    std::size_t wanted = 0;
    for (int i = 0; i < 60; ++i) {
        const RandomGrid g = random_grid(random);
        const Counted counted(g.volume, g.isovalue, true);
        const EmitInput& input = counted.input();
        SnapOutput surface = surface_of(input, SnapExceptions(input), 0.2);
        shake(input.to_physical, 0.28, random, surface.mesh);
        std::vector<std::uint8_t> layers(surface.slices());
        for (std::uint8_t& layer : layers) layer = random() % 4 == 0 ? 1 : 0;
        const std::vector<TrianglePair> all = find_self_intersections(surface.mesh, OneRings(surface.mesh));
        const std::vector<TrianglePair> pairs = find_intersections(input, 0.48, surface, layers, {}, 0, 1);
        EXPECT_TRUE(std::includes(all.begin(), all.end(), pairs.begin(), pairs.end()));
        const auto is_marked = [&](std::uint32_t t) {
            std::size_t z = 0;
            while (surface.starts[z + 1].triangle <= t) ++z;
            return layers[z] != 0;
        };
        for (const TrianglePair& pair : all) {
            if (!is_marked(pair[0]) && !is_marked(pair[1])) continue;
            EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), pair));
            ++wanted;
        }
    }
    EXPECT_GT(wanted, 50u);
}

TEST_P(SnapSearch, SlicesThatAreMadeAgainAreThoseOfAWholeSurface) {
    Random random(static_cast<std::uint64_t>(200 + GetParam()));
    std::uniform_real_distribution<double> noise(-1, 1);
    const Volume volume = sampled<float>(
        grid(12, 10, 40), [&](auto, auto, auto z) { return noise(random) + (z > 30 ? 2 : 0); });
    for (const bool closed : {true, false}) {
        const Counted counted(volume, 0, closed);
        const EmitInput& input = counted.input();
        SnapExceptions exceptions(input);
        SnapOutput surface = surface_of(input, exceptions, 0.3);
        for (int round = 0; round < 6; ++round) {
            const std::size_t points_before = surface.mesh.points.size();
            for (int i = 0; i < 1 + round; ++i) {
                const auto t = static_cast<std::size_t>(random() % surface.mesh.triangles.size());
                exceptions.add(surface.mesh, surface.mesh.triangles[t], round / 2);
            }
            std::vector<std::uint8_t> layers(surface.slices());
            make_again(input, exceptions, 0.3f, exceptions.take_changed_slices(), {}, surface, layers);
            const SnapOutput whole = surface_of(input, exceptions, 0.3);
            ASSERT_EQ(mesh_hash(surface.mesh), mesh_hash(whole.mesh)) << round;
            EXPECT_GE(surface.mesh.points.size(), points_before);
            EXPECT_EQ(surface.cells, whole.cells);
            ASSERT_EQ(surface.caps.size(), whole.caps.size());
            for (std::size_t i = 0; i < whole.caps.size(); ++i) {
                EXPECT_EQ(surface.caps[i].triangle, whole.caps[i].triangle);
                EXPECT_EQ(surface.caps[i].moved, whole.caps[i].moved);
            }
            ASSERT_EQ(surface.starts.size(), whole.starts.size());
            for (std::size_t z = 0; z < whole.starts.size(); ++z) {
                EXPECT_EQ(surface.starts[z].point, whole.starts[z].point);
                EXPECT_EQ(surface.starts[z].triangle, whole.starts[z].triangle);
                EXPECT_EQ(surface.starts[z].cap, whole.starts[z].cap);
            }
        }
    }
}

TEST(SnappedNoise, DoesNotPassThroughItselfWhereItDidAtFirst) {
    std::uniform_real_distribution<double> noise(-1, 1);
    std::size_t passed_through = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
        Random random(seed);
        const Volume volume =
            sampled<float>(grid(70, 12, 40), [&](auto, auto, auto) { return noise(random); });
        const Counted counted(volume, 0, true);
        for (const double limit : {0.45, 0.49}) {
            const SnapOutput first = surface_of(counted.input(), SnapExceptions(counted.input()), limit);
            passed_through += find_self_intersections(first.mesh, OneRings(first.mesh)).size();
            const Mesh mesh = extract_isosurface(volume, 0, {.closed = true, .snap = limit});
            EXPECT_TRUE(find_self_intersections(mesh, OneRings(mesh)).empty()) << seed << ' ' << limit;
        }
    }
    EXPECT_GT(passed_through, 5u);
}

}  // namespace
}  // namespace marrow::test
