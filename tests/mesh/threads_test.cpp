// Tests that the functions on meshes give the same bits for any number of threads, and use no more threads
// than asked.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <mutex>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <marrow/components.h>
#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/simplify.h>
#include <marrow/smooth.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

// A closed surface with noise, cavities, specks and thin walls.
Mesh noisy_ball() {
    Random random(31);
    const auto ball = sphere({15, 15, 15}, 11);
    const Volume volume = sampled_in_space<float>(grid(31, 31, 31), [&](const Vec3d& p) {
        return ball(p) + std::normal_distribution<double>(0, 0.8)(random);
    });
    return extract_isosurface(volume, 0, {.closed = true});
}

using Words = std::vector<std::uint64_t>;

std::uint64_t bits(double x) {
    return std::bit_cast<std::uint64_t>(x);
}

// A function on meshes that uses threads. It returns all bits of its result.
struct Function {
    std::string name;
    std::function<Words(const Mesh& mesh, int threads)> run;
};

std::vector<Function> functions() {
    return {
        {"keep_components",
         [](const Mesh& mesh, int threads) {
             return Words{mesh_hash(keep_components(mesh, {.count = 3, .threads = threads}))};
         }},
        {"smooth",
         [](const Mesh& mesh, int threads) { return Words{mesh_hash(smooth(mesh, {.threads = threads}))}; }},
        {"simplify to a count",
         [](const Mesh& mesh, int threads) {
             return Words{mesh_hash(simplify(mesh, {.triangles = 2000, .threads = threads}))};
         }},
        {"simplify within an error",
         [](const Mesh& mesh, int threads) {
             SimplifyStats stats;
             const Mesh reduced = simplify(mesh, {.max_error = 0.3, .threads = threads}, &stats);
             return Words{mesh_hash(reduced), bits(stats.deviation.mean), bits(stats.deviation.max)};
         }},
        {"measure",
         [](const Mesh& mesh, int threads) {
             const MeshMeasures m = measure(mesh, {.threads = threads});
             Words words{static_cast<std::uint64_t>(m.components),
                         static_cast<std::uint64_t>(m.cavities),
                         static_cast<std::uint64_t>(m.euler_characteristic),
                         static_cast<std::uint64_t>(m.boundary_edges),
                         static_cast<std::uint64_t>(m.nonmanifold_edges),
                         bits(m.area),
                         bits(m.volume)};
             for (const Vec3f& corner : {m.lower, m.upper}) {
                 for (const float x : corner) words.push_back(bits(x));
             }
             return words;
         }},
        {"check_mesh",
         [](const Mesh& mesh, int threads) {
             const MeshCheck check = check_mesh(smooth(mesh), {.min_wall = 0.5, .threads = threads});
             return Words{static_cast<std::uint64_t>(check.self_intersections),
                          static_cast<std::uint64_t>(check.thin_triangles), bits(check.thin_area),
                          bits(check.thinnest_wall.value_or(-1))};
         }},
        {"mean_curvature",
         [](const Mesh& mesh, int threads) {
             Words words;
             for (const double h : mean_curvature(mesh, {.threads = threads})) words.push_back(bits(h));
             return words;
         }},
        {"roughness",
         [](const Mesh& mesh, int threads) {
             const Roughness r = roughness(mesh, 3, {.threads = threads});
             return Words{bits(r.roughness), bits(r.mean_curvature), static_cast<std::uint64_t>(r.points)};
         }},
        {"mesh_distance",
         [](const Mesh& mesh, int threads) {
             const MeshDistance d = mesh_distance(mesh, smooth(mesh), {.threads = threads});
             return Words{bits(d.mean), bits(d.max)};
         }},
    };
}

TEST(MeshThreads, AnyNumberGivesTheSameBits) {
    const Mesh mesh = noisy_ball();
    for (const Function& function : functions()) {
        const Words all = function.run(mesh, 0);
        for (const int threads : {1, 2, 3})
            EXPECT_TRUE(function.run(mesh, threads) == all) << function.name << ", threads " << threads;
    }
}

// The same surface with its points and triangles in random order.
Mesh shuffled(const Mesh& mesh) {
    Random random(5);
    std::vector<std::uint32_t> place(mesh.points.size());
    std::iota(place.begin(), place.end(), 0u);
    std::shuffle(place.begin(), place.end(), random);
    Mesh result = mesh;
    for (std::size_t p = 0; p < place.size(); ++p) {
        result.points[place[p]] = mesh.points[p];
        result.normals[place[p]] = mesh.normals[p];
    }
    for (Triangle& t : result.triangles) t = {place[t[0]], place[t[1]], place[t[2]]};
    std::shuffle(result.triangles.begin(), result.triangles.end(), random);
    return result;
}

// Large enough that threads share the points and the triangles, and so disordered that they meet everywhere.
TEST(MeshThreads, FindTheComponentsOfAShuffledMesh) {
    const auto large = sphere({36, 36, 36}, 33), cavity = sphere({36, 36, 36}, 22),
               small = sphere({95, 36, 36}, 20);
    const Volume volume = sampled_in_space<float>(grid(120, 73, 73), [&](const Vec3d& p) {
        return std::max(std::min(large(p), -cavity(p)), small(p));
    });
    const Mesh ordered = extract_isosurface(volume, 0);
    ASSERT_GT(ordered.triangles.size(), 50000u);
    const Mesh kept = keep_components(ordered, {.count = 1});
    // The copy is divided among threads, and keeps the order.
    const Volume without_small = sampled_in_space<float>(
        grid(120, 73, 73), [&](const Vec3d& p) { return std::min(large(p), -cavity(p)); });
    EXPECT_EQ(mesh_hash(kept), mesh_hash(extract_isosurface(without_small, 0)));
    const Mesh mesh = shuffled(ordered);
    const double volume_of_all = measure(mesh, {.threads = 1}).volume;
    for (const int threads : {0, 1, 2, 3}) {
        const MeshMeasures m = measure(mesh, {.threads = threads});
        const AreaAndVolume size = area_and_volume(mesh, {.threads = threads});
        EXPECT_EQ(bits(size.area), bits(m.area));
        EXPECT_EQ(bits(size.volume), bits(m.volume));
        EXPECT_EQ(m.components, 3);
        EXPECT_EQ(m.cavities, 1);
        EXPECT_EQ(m.boundary_edges, 0);
        EXPECT_EQ(bits(m.volume), bits(volume_of_all)) << threads;
        const Mesh largest = keep_components(mesh, {.count = 1, .threads = threads});
        EXPECT_EQ(largest.points.size(), kept.points.size());
        EXPECT_EQ(largest.triangles.size(), kept.triangles.size());
    }
}

// Functions that run on one thread must do all work on the thread of the caller. Those that report progress
// do so from the threads that work.
TEST(MeshThreads, OneThreadIsTheCaller) {
    const Mesh mesh = noisy_ball(), smoothed = smooth(mesh);
    std::mutex mutex;
    std::set<std::thread::id> used;
    const Progress progress = [&](double) {
        const std::lock_guard lock(mutex);
        used.insert(std::this_thread::get_id());
        return true;
    };
    smooth(mesh, {.threads = 1, .progress = progress});
    simplify(mesh, {.triangles = 2000, .threads = 1, .progress = progress});
    check_mesh(mesh, {.min_wall = 0.5, .threads = 1, .progress = progress});
    mean_curvature(mesh, {.threads = 1, .progress = progress});
    roughness(mesh, 3, {.threads = 1, .progress = progress});
    mesh_distance(mesh, smoothed, {.threads = 1, .progress = progress});
    EXPECT_TRUE(used == std::set{std::this_thread::get_id()});
}

std::ptrdiff_t threads_of_process() {
    return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
}

TEST(MeshThreads, OneThreadStartsNoOther) {
    const Volume volume = sampled_in_space<float>(grid(31, 31, 31), sphere({15, 15, 15}, 11));
    const Mesh mesh = extract_isosurface(volume, 0, {.threads = 1});
    const std::ptrdiff_t before = threads_of_process();
    keep_components(mesh, {.count = 1, .threads = 1});
    measure(mesh, {.threads = 1});
    const Mesh smoothed = smooth(mesh, {.threads = 1});
    simplify(mesh, {.max_error = 0.3, .threads = 1});
    check_mesh(mesh, {.min_wall = 0.5, .threads = 1});
    mean_curvature(mesh, {.threads = 1});
    roughness(mesh, 3, {.threads = 1});
    mesh_distance(mesh, smoothed, {.threads = 1});
    EXPECT_LE(threads_of_process(), before);
}

TEST(MeshThreads, ProgressNeverRunsBackward) {
    const Mesh mesh = noisy_ball(), smoothed = smooth(mesh);
    double last = 0;
    const Progress progress = [&](double fraction) {
        EXPECT_GE(fraction, last);
        EXPECT_LE(fraction, 1 + 1e-9);
        last = fraction;
        return true;
    };
    check_mesh(mesh, {.min_wall = 0.5, .progress = progress});
    EXPECT_NEAR(last, 1, 1e-9);
    last = 0;
    roughness(mesh, 3, {.progress = progress});
    EXPECT_NEAR(last, 1, 1e-9);
    last = 0;
    mesh_distance(mesh, smoothed, {.progress = progress});
    EXPECT_NEAR(last, 1, 1e-9);
    last = 0;
    smooth(mesh, {.progress = progress});
    last = 0;
    simplify(mesh, {.max_error = 0.3, .progress = progress});
    EXPECT_GT(last, 0);
}

}  // namespace
}  // namespace marrow::test
