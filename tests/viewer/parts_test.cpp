// Tests the parts of the viewer that need no display.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include <marrow/isosurface.h>
#include <marrow/volume_filters.h>

#include "model/ray_pick.h"
#include "model/worker.h"
#include "shared/report_progress.h"
#include "views/slice_geometry.h"

namespace marrow::viewer {
namespace {

std::shared_ptr<Scan> noise(std::array<std::int64_t, 3> dims, const Mat3d& direction, unsigned seed) {
    Geometry geometry;
    geometry.dims = dims;
    geometry.spacing = {0.7, 1.1, 1.9};
    geometry.origin = {-3, 5, 8};
    geometry.direction = direction;
    auto scan = std::make_shared<Scan>();
    scan->volume = Volume(geometry, SampleType::int16);
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> level(-3, 3);  // ties with the isovalue too
    for (std::int64_t i = 0; i < geometry.sample_count(); ++i)
        scan->volume.samples<std::int16_t>()[i] = static_cast<std::int16_t>(level(random));
    scan->histogram = histogram(scan->volume);
    return scan;
}

constexpr Mat3d kStraight{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
// Sagittal acquisition: i to posterior, j to inferior, k to the right.
constexpr Mat3d kSagittal{{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};

// The ends of the contour are the points of the surface on that slice.
TEST(SliceContour, MeetsTheSurface) {
    for (const Mat3d& direction : {kStraight, kSagittal}) {
        for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal}) {
            for (const double isovalue : {0.5, 1.0}) {  // some samples equal 1
                const auto scan = noise({7, 8, 9}, direction, 5);
                const SliceGeometry slice = slice_geometry(scan->volume.geometry(), plane);
                const auto through = static_cast<std::size_t>(slice.through);
                constexpr std::int64_t kSlice = 4;
                std::vector<Vec3d> ends;
                for (const QLineF& line : slice_contour(
                         slice_samples(scan->volume, slice, kSlice), slice.size,
                         slice_range(slice, {{0, 0, 0}, {6, 7, 8}}, kSlice), isovalue, false, false)) {
                    for (const QPointF& end : {line.p1(), line.p2()}) {
                        Vec3d other{};
                        other[through] = kSlice;
                        ends.push_back(scan->volume.geometry().physical(slice.to_index(end, other)));
                    }
                }
                std::vector<Vec3d> points;
                for (const Vec3f& p : extract_isosurface(scan->volume, isovalue).points) {
                    const Vec3d position{p[0], p[1], p[2]};
                    const Vec3d index = index_of(scan->volume.geometry(), position);
                    if (std::abs(index[through] - kSlice) < 1e-4) points.push_back(position);
                }
                ASSERT_GT(points.size(), 20u);
                const auto all_in = [](const std::vector<Vec3d>& some, const std::vector<Vec3d>& others) {
                    return std::all_of(some.begin(), some.end(), [&](const Vec3d& a) {
                        return std::any_of(others.begin(), others.end(), [&](const Vec3d& b) {
                            return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) < 1e-3;
                        });
                    });
                };
                EXPECT_TRUE(all_in(ends, points)) << static_cast<int>(plane);
                // If a sample equals the isovalue, the surface can touch the slice without crossing it.
                if (isovalue == 0.5) {
                    EXPECT_TRUE(all_in(points, ends)) << static_cast<int>(plane);
                }
            }
        }
    }
}

// Lines from the samples and from the mesh agree on all slices, inside and at the border of a box.
void expect_outlines_of_surface(const Scan& scan, const SampleBox& box, double isovalue, bool closed,
                                bool topology) {
    const Geometry& geometry = scan.volume.geometry();
    const Volume cropped = crop(scan.volume, box.first, box.last);
    const Mesh mesh = extract_isosurface(cropped, isovalue, {.closed = closed, .topology = topology});
    double all = 0;
    for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal}) {
        const SliceGeometry slice = slice_geometry(geometry, plane);
        const auto through = static_cast<std::size_t>(slice.through);
        for (std::int64_t number = 0; number < geometry.dims[through]; ++number) {
            const auto trace = ::testing::Message()
                               << static_cast<int>(plane) << " slice " << number << " closed " << closed
                               << " topology " << topology << " from " << box.first[through];
            const QVector<QLineF> cut = slice_mesh(mesh, geometry, box, slice, number);
            const QVector<QLineF> contour =
                slice_contour(slice_samples(scan.volume, slice, number), slice.size,
                              slice_range(slice, box, number), isovalue, closed, topology);
            const auto length = [](const QVector<QLineF>& lines) {
                double sum = 0;
                for (const QLineF& line : lines) sum += line.length();
                return sum;
            };
            const bool in_box = number >= box.first[through] && number <= box.last[through];
            ASSERT_TRUE(in_box || contour.empty()) << trace;
            all += length(contour);
            ASSERT_NEAR(length(cut), length(contour), 1e-3 * length(contour)) << trace;
            for (const QLineF& line : cut) {
                ASSERT_TRUE(std::any_of(contour.begin(), contour.end(), [&](const QLineF& other) {
                    const auto near = [](const QPointF& a, const QPointF& b) {
                        return std::hypot(a.x() - b.x(), a.y() - b.y()) < 1e-3;
                    };
                    return (near(line.p1(), other.p1()) && near(line.p2(), other.p2())) ||
                           (near(line.p1(), other.p2()) && near(line.p2(), other.p1()));
                })) << trace;
            }
        }
    }
    EXPECT_GT(all, 50) << closed << topology;
}

TEST(SliceContour, IsWhereTheMeshMeetsTheSlice) {
    for (const Mat3d& direction : {kStraight, kSagittal}) {
        const auto scan = noise({9, 8, 7}, direction, 6);
        for (const SampleBox& box : {SampleBox{{0, 0, 0}, {8, 7, 6}}, SampleBox{{2, 1, 3}, {6, 7, 4}}}) {
            for (const bool closed : {false, true}) {
                expect_outlines_of_surface(*scan, box, 0.5, closed, false);
                // Without ties, in which points within a cell can be on its faces.
                expect_outlines_of_surface(*scan, box, 0.45, closed, true);
            }
        }
    }
}

// Ties join corners, and samples that are not finite leave them separated, on the surface and on the outline.
// All slices are equal, so that there are no points within cells.
TEST(SliceContour, DecidesAsTheSurfaceDoes) {
    const auto scan = noise({20, 20, 4}, kStraight, 8);
    Volume samples(scan->volume.geometry(), SampleType::float32);
    std::mt19937 random(9);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr std::array<float, 6> kValues{-1.5F, -1.5F, 1.5F, 1.5F, kInfinity, -kInfinity};
    constexpr std::int64_t kSlice = 20 * 20;
    for (std::int64_t i = 0; i < samples.geometry().sample_count(); ++i)
        samples.samples<float>()[i] =
            i < kSlice ? kValues[random() % (i % 5 == 0 ? 6 : 4)] : samples.samples<float>()[i - kSlice];
    scan->volume = std::move(samples);
    for (const bool closed : {false, true})
        expect_outlines_of_surface(*scan, {{0, 0, 0}, {19, 19, 3}}, 0, closed, true);
}

// The patient's right is on the left of an axial slice and superior is up, however the scan was acquired.
TEST(SliceGeometry, FollowsTheConventionOfRadiology) {
    for (const Mat3d& direction : {kStraight, kSagittal, Mat3d{{{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}}}) {
        const auto scan = noise({7, 8, 9}, direction, 1);
        const Geometry& g = scan->volume.geometry();
        for (const Plane plane : {Plane::axial, Plane::coronal, Plane::sagittal}) {
            const SliceGeometry slice = slice_geometry(g, plane);
            const Vec3d at{3, 3, 3};
            const QPointF point = slice.to_slice(at);
            const auto step = [&](double right, double down) {
                const Vec3d from = g.physical(at);
                const Vec3d to = g.physical(slice.to_index(point + QPointF(right, down), at));
                return Vec3d{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
            };
            const std::size_t across = plane == Plane::sagittal ? 1 : 0;  // to the left, or to posterior
            EXPECT_GT(step(1, 0)[across], 0.1);
            if (plane == Plane::axial)
                EXPECT_GT(step(0, 1)[1], 0.1);  // posterior is below
            else
                EXPECT_LT(step(0, 1)[2], -0.1);  // inferior is below
            // The samples match this point.
            const std::vector<float> samples = slice_samples(scan->volume, slice, 3);
            const auto u = static_cast<std::int64_t>(point.x()), v = static_cast<std::int64_t>(point.y());
            EXPECT_EQ(samples[static_cast<std::size_t>(v * slice.size[0] + u)],
                      sample_at(scan->volume, 3, 3, 3));
        }
    }
}

TEST(SliceGeometry, SlicesHaveTheValuesOfTheSamples) {
    const auto scan = noise({7, 8, 9}, kSagittal, 5);
    Volume volume = crop(scan->volume, {0, 0, 0}, {6, 7, 8});
    volume.set_rescale({0.37, -2643.4});
    const SliceGeometry slice = slice_geometry(volume.geometry(), Plane::axial);
    const std::vector<float> stored = slice_samples(scan->volume, slice, 3),
                             values = slice_samples(volume, slice, 3);
    for (std::size_t i = 0; i < values.size(); ++i)
        EXPECT_EQ(values[i], static_cast<float>(0.37 * stored[i] - 2643.4));
    const double spacing = volume.geometry().spacing[static_cast<std::size_t>(slice.through)];
    for (const Slab::Mode mode : {Slab::Mode::maximum, Slab::Mode::mean}) {
        const std::vector<float> of_samples = slab_samples(scan->volume, slice, 3, {mode, 3 * spacing}),
                                 of_values = slab_samples(volume, slice, 3, {mode, 3 * spacing});
        for (std::size_t i = 0; i < of_values.size(); ++i)
            EXPECT_NEAR(of_values[i], 0.37 * of_samples[i] - 2643.4, 1e-3);
    }
    EXPECT_EQ(sample_at(volume, 3, 2, 1), 0.37 * sample_at(scan->volume, 3, 2, 1) - 2643.4);
}

TEST(RayPick, FindsTheNearestVisibleHit) {
    Mesh mesh;  // two squares across z, at 1 and 3
    for (const float z : {1.F, 3.F}) {
        const auto first = static_cast<std::uint32_t>(mesh.points.size());
        for (const auto& [x, y] : {std::pair{-1.F, -1.F}, {1.F, -1.F}, {1.F, 1.F}, {-1.F, 1.F}})
            mesh.points.push_back({x, y, z});
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
    }
    const Ray ray{{0.3, 0.2, 0}, {0, 0, 1}};
    EXPECT_NEAR(first_hit(mesh, ray, {}).value(), 1, 1e-12);
    EXPECT_NEAR(first_hit(mesh, ray, HalfSpace{{0, 0, 2}, {0, 0, 1}}).value(), 3, 1e-12);
    EXPECT_FALSE(first_hit(mesh, ray, HalfSpace{{0, 0, 4}, {0, 0, 1}}));
    EXPECT_FALSE(first_hit(mesh, {{0.3, 0.2, 0}, {0, 0, -1}}, {}));
    EXPECT_FALSE(first_hit(mesh, {{2, 0, 0}, {0, 0, 1}}, {}));
}

TEST(Worker, TheNewestRequestWinsAndUrgentOnesInterrupt) {
    std::atomic<int> slow_starts{0}, slow_ends{0}, old_ends{0}, urgent_ends{0};
    std::atomic<bool> stop{false};
    Worker worker;
    const auto slow = [&](const Progress& job_progress) {
        ++slow_starts;
        while (!stop) {
            apps::report(job_progress, 0);
            std::this_thread::yield();
        }
        ++slow_ends;
    };
    worker.post({1, 0}, slow);
    while (slow_starts == 0) std::this_thread::yield();
    worker.post({2, 0}, [&](const Progress&) { ++old_ends; });  // waits and is replaced
    worker.post({2, 0}, [&](const Progress&) {});
    worker.post({0, 0}, [&](const Progress&) { ++urgent_ends; });
    while (urgent_ends == 0 || slow_starts < 2) std::this_thread::yield();  // interrupted, then restarted
    EXPECT_EQ(slow_ends, 0);
    worker.forget({1, 0});  // the running job
    worker.post({1, 0}, [&](const Progress&) { stop = true; });
    while (!stop) std::this_thread::yield();
    worker.forget_all();
    EXPECT_EQ(slow_ends, 0);
    EXPECT_EQ(old_ends, 0);
}

TEST(Worker, FrequentRequestsDoNotStarve) {
    std::atomic<int> starts{0}, ends{0};
    std::atomic<bool> stop{false};
    Worker worker;
    const auto job = [&](const Progress& job_progress) {
        ++starts;
        while (!stop) {
            apps::report(job_progress, 0);
            std::this_thread::yield();
        }
        ++ends;
    };
    worker.post({0, 0}, job);
    while (starts == 0) std::this_thread::yield();
    for (int i = 0; i < 10; ++i) worker.post({0, 0}, job);
    stop = true;
    while (ends < 2) std::this_thread::yield();  // the running one and the newest
    worker.post({0, 0}, [&](const Progress&) { stop = false; });
    while (stop) std::this_thread::yield();
    EXPECT_EQ(starts, 2);
    EXPECT_EQ(ends, 2);
}

TEST(Worker, EqualUrgencyDoesNotInterrupt) {
    std::atomic<int> starts{0}, reports{0};
    std::atomic<bool> stop{false}, other{false};
    Worker worker;
    worker.post({1, 7}, [&](const Progress& job_progress) {
        ++starts;
        for (; !stop; ++reports) {
            apps::report(job_progress, 0);
            std::this_thread::yield();
        }
    });
    while (starts == 0) std::this_thread::yield();
    worker.post({1, 3}, [&](const Progress&) { other = true; });
    const int before = reports;
    while (starts < 2 && reports < before + 10) std::this_thread::yield();
    stop = true;
    while (!other) std::this_thread::yield();
    EXPECT_EQ(starts, 1);
}

TEST(Session, ResumesWithTheSurfaceThatWasCurrent) {
    for (int current = 0; current < 5; ++current) {
        Session session;
        session.set_scan(noise({8, 8, 8}, kStraight, 3));
        Parameters saved = session.parameters();
        saved.surfaces.resize(5, saved.surfaces.front());
        for (int i = 0; i < 5; ++i) {
            saved.surfaces[static_cast<std::size_t>(i)].id = i;
            saved.surfaces[static_cast<std::size_t>(i)].isovalue = 0.5 * i - 1;
        }
        saved.current = current;
        session.resume(saved, {1, 2, 3});
        EXPECT_EQ(session.current()->isovalue, 0.5 * current - 1);
    }
}

TEST(Session, UndoesEverythingInSteps) {
    Session session;
    session.set_scan(noise({8, 8, 8}, kStraight, 3));
    const Parameters first = session.parameters();
    std::vector<Parameters> states{first};
    std::mt19937 random(11);
    for (int i = 0; i < 200; ++i) {
        const int what = static_cast<int>(random() % 9);
        const double value = static_cast<double>(random() % 1000) / 250 - 2;
        const int before = session.undo_stack().index();
        switch (what) {
            case 0:
                session.set_isovalue(value);
                break;
            case 1:
                session.add_surface("s", value, {}, 0.5);
                break;
            case 2:
                session.remove_surface(session.parameters().surfaces.front().id);
                break;
            case 3:
                session.change("largest", {}, [](Parameters& p) { p.largest = !p.largest; });
                break;
            case 4:
                session.change("cut", {}, [](Parameters& p) { p.cut.plane = Plane::coronal; });
                break;
            case 5:
                session.change("flip", {}, [](Parameters& p) { p.cut.flipped = !p.cut.flipped; });
                break;
            case 6:
                session.change("mode", {}, [](Parameters& p) { p.mode = DrawMode::points; });
                break;
            case 7:
                session.set_tool(Tool::distance);
                session.click({value, 0, 0});
                session.click({0, value, 0});
                break;
            case 8:
                session.move_crop_side({random() % 3, random() % 2 == 0}, 4 + 2 * value);
                break;
        }
        session.end_step();
        if (session.undo_stack().index() > before) states.push_back(session.parameters());
    }
    ASSERT_GT(states.size(), 60u);
    for (std::size_t i = states.size(); i-- > 0;) {
        EXPECT_TRUE(session.parameters() == states[i]) << i;
        session.undo_stack().undo();
    }
    EXPECT_FALSE(session.undo_stack().canUndo());
    for (std::size_t i = 1; i < states.size(); ++i) session.undo_stack().redo();
    EXPECT_TRUE(session.parameters() == states.back());
    // A drag is one step of undo.
    session.end_step();
    const int before = session.undo_stack().index();
    for (int i = 0; i < 20; ++i) session.set_isovalue(i * 0.01);
    EXPECT_EQ(session.undo_stack().index(), before + 1);
}

}  // namespace
}  // namespace marrow::viewer
