// Every SIMD target that the machine has gives the same bytes.
#include <gtest/gtest.h>

#define HWY_WANT_AVX3_DL 1  // some of the core has code of its own for it
#include <hwy/highway.h>
#include <hwy/targets.h>

#include <tuple>

#include <marrow/components.h>
#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/labels.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

// The targets that the machine has and Highway compiles. The core may leave out some of these (see its
// CMakeLists.txt) and then runs scalar code.
std::vector<std::int64_t> available_targets() {
    std::vector<std::int64_t> targets;
    for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1)
        targets.push_back(left & -left);
    return targets;
}

// Makes Highway choose one target during its lifetime.
class Forced {
  public:
    explicit Forced(std::int64_t target) { set(target); }
    ~Forced() { set(0); }

  private:
    static void set(std::int64_t targets) {
        hwy::SetSupportedTargetsForTest(targets);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
};

template <class T>
std::uint64_t hash_on(std::int64_t target, bool closed, bool topology) {
    const Forced forced(target);
    const Volume volume = sampled<T>(grid(201, 40, 30), [](auto x, auto y, auto z) {
        return 60 +
               40 * std::sin(0.2 * static_cast<double>(x) + 0.1 * static_cast<double>(z)) *
                   std::cos(0.31 * static_cast<double>(y)) +
               static_cast<double>((x * 7919 + y * 104729 + z * 1299709) % 23);
    });
    const IsosurfaceOptions options{.closed = closed, .topology = topology};
    IsosurfaceExtractor extractor(volume, options);
    extractor.extract(50);
    const std::uint64_t next = mesh_hash(extractor.extract(66.5));
    EXPECT_EQ(next, mesh_hash(extract_isosurface(volume, 66.5, options)));
    return next;
}

// Labels in blobs, with specks of other labels so that three and more of them meet.
template <class T>
std::vector<std::uint64_t> label_hashes_on(std::int64_t target, const LabelOptions& options) {
    const Forced forced(target);
    Geometry geometry = grid(135, 21, 27);
    geometry.spacing = {0.7, 0.9, 2.1};
    const Volume map = sampled<T>(geometry, [](auto x, auto y, auto z) {
        const auto hash = static_cast<std::uint32_t>(x * 7919 + y * 104729 + z * 1299709) * 2654435761u;
        if (hash >> 26 == 0) return static_cast<double>(hash >> 16 & 7);
        return std::floor(2.5 + 2.5 * std::sin(0.11 * static_cast<double>(x)) *
                                    std::cos(0.23 * static_cast<double>(y) + 0.19 * static_cast<double>(z)));
    });
    std::vector<std::uint64_t> hashes;
    for (const LabelSurface& s : extract_labels(map, options)) {
        hashes.push_back(static_cast<std::uint64_t>(s.label));
        hashes.push_back(mesh_hash(s.mesh));
    }
    return hashes;
}

template <class T>
class SimdTargets : public testing::Test {};
using SampleTypes =
    testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::int32_t, float, double>;
TYPED_TEST_SUITE(SimdTargets, SampleTypes);

TYPED_TEST(SimdTargets, AgreeByteForByte) {
    const auto targets = available_targets();
    ASSERT_FALSE(targets.empty());
    for (const bool closed : {false, true}) {
        for (const bool topology : {false, true}) {
            const std::uint64_t best = hash_on<TypeParam>(targets.front(), closed, topology);
            for (const std::int64_t target : targets)
                EXPECT_EQ(hash_on<TypeParam>(target, closed, topology), best) << hwy::TargetName(target);
        }
    }
}

TYPED_TEST(SimdTargets, AgreeByteForByteOnLabelMaps) {
    const auto targets = available_targets();
    for (const int relax : {0, 1, 40}) {
        const auto best = label_hashes_on<TypeParam>(targets.front(), {.relax = relax, .threads = 1});
        EXPECT_EQ(best.size(), 2 * 7u);
        for (const std::int64_t target : targets) {
            for (const int threads : {1, 3})
                EXPECT_EQ(label_hashes_on<TypeParam>(target, {.relax = relax, .threads = threads}), best)
                    << hwy::TargetName(target) << ", relax " << relax << ", threads " << threads;
        }
    }
}

TEST(SimdTargets, SweepsAgreeExactly) {
    const Volume volume = sampled<std::int16_t>(grid(70, 20, 15), [](auto x, auto y, auto z) {
        return static_cast<double>((x * 7919 + y * 104729 + z * 1299709) % 211);
    });
    const std::vector<double> isovalues{10, 50.5, 51, 150};
    const auto sweep_on = [&](std::int64_t target) {
        const Forced forced(target);
        std::vector<double> numbers;
        for (const SweepSample& s : sweep_isovalues(volume, isovalues)) {
            numbers.insert(numbers.end(), {s.area, s.volume, static_cast<double>(s.components),
                                           static_cast<double>(s.triangles)});
        }
        return numbers;
    };
    const auto targets = available_targets();
    const auto best = sweep_on(targets.front());
    for (const std::int64_t target : targets) EXPECT_EQ(sweep_on(target), best) << hwy::TargetName(target);
}

TEST(SimdTargets, ReductionsAndDistancesAgreeExactly) {
    const Volume volume = sampled_in_space<float>(grid(60, 60, 60), torus({30, 30, 30}, 17, 7));
    const Mesh mesh = extract_isosurface(volume, 0);
    const auto reduce_on = [&](std::int64_t target) {
        const Forced forced(target);
        SimplifyStats by_count, by_error;
        const Mesh few = simplify(mesh, {.triangles = 2000}, &by_count);
        const Mesh near = simplify(mesh, {.max_error = 0.05}, &by_error);
        return std::tuple(mesh_hash(few), mesh_hash(near), by_count.deviation.mean, by_count.deviation.max,
                          by_error.deviation.mean, by_error.deviation.max);
    };
    const auto targets = available_targets();
    const auto best = reduce_on(targets.front());
    EXPECT_GT(std::get<2>(best), 0);
    for (const std::int64_t target : targets) EXPECT_EQ(reduce_on(target), best) << hwy::TargetName(target);
}

TEST(SimdTargets, SmoothedSurfacesAndTheirIntersectionsAgreeExactly) {
    Random random(4);
    const Volume volume = sampled_in_space<float>(grid(40, 40, 40), torus({20, 20, 20}, 11, 5));
    Mesh mesh = extract_isosurface(volume, 0);
    for (Vec3f& p : mesh.points) {
        for (float& x : p) x += static_cast<float>(std::normal_distribution<double>(0, 0.1)(random));
    }
    const auto smooth_on = [&](std::int64_t target) {
        const Forced forced(target);
        SmoothStats stats;
        const Mesh smoothed = smooth(mesh, {}, &stats);
        return std::tuple(check_mesh(mesh).self_intersections, mesh_hash(smoothed), stats.held_back_points);
    };
    const auto targets = available_targets();
    const auto best = smooth_on(targets.front());
    EXPECT_GT(std::get<0>(best), 0);
    for (const std::int64_t target : targets) EXPECT_EQ(smooth_on(target), best) << hwy::TargetName(target);
}

TEST(SimdTargets, RandomGridsAreClosedAndClassicOnEach) {
    for (const std::int64_t target : available_targets()) {
        const Forced forced(target);
        Random random(77);
        for (int i = 0; i < 2000; ++i) {
            const RandomGrid g = random_grid(random);
            const Mesh mesh = extract_isosurface(g.volume, g.isovalue, {.closed = true, .threads = 1});
            ASSERT_EQ(manifold_fault(mesh), "") << hwy::TargetName(target) << " grid " << i;
            ASSERT_EQ(triangle_positions(mesh),
                      triangle_positions(extract_isosurface_classic(g.volume, g.isovalue, true)))
                << hwy::TargetName(target) << " grid " << i;
        }
    }
}

TEST(SimdTargets, AnyNumberOfActiveCellsInAWordIsClassicOnEach) {
    // From row to row more samples are inside: none in the first, all in the last.
    const Volume volume = sampled<std::int16_t>(grid(130, 65, 9), [](auto x, auto y, auto z) {
        const auto hash = static_cast<std::uint32_t>(x * 7919 + y * 104729 + z * 1299709) * 2654435761u;
        return hash >> 26 < static_cast<std::uint32_t>(y) ? 1.0 : 0.0;
    });
    const auto classic = triangle_positions(extract_isosurface_classic(volume, 0.5, false));
    ASSERT_FALSE(classic.empty());
    for (const std::int64_t target : available_targets()) {
        const Forced forced(target);
        ASSERT_EQ(triangle_positions(extract_isosurface(volume, 0.5, {.threads = 1})), classic)
            << hwy::TargetName(target);
    }
}

}  // namespace
}  // namespace marrow::test
