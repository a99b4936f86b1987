// Progress and threads of every function that reports progress.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/streaming.h>
#include <marrow/volume_filters.h>

#include "base/parallel.h"
#include "support/fields.h"

namespace marrow::test {
namespace {

Volume blobs(bool with_nan) {
    return sampled<float>(grid(40, 41, 42), [=](auto x, auto y, auto z) {
        if (with_nan && x == 7 && y == 9 && z == 11) return std::nan("");
        return std::sin(0.3 * static_cast<double>(x)) + std::cos(0.4 * static_cast<double>(y)) +
               std::sin(0.5 * static_cast<double>(z));
    });
}

struct Work {
    const char* name;
    std::function<void(const Volume& volume, int threads, const Progress& progress)> run;
};

void extract_in_slabs(const Volume& volume, int threads, const Progress& progress) {
    const Geometry& g = volume.geometry();
    const auto slice = static_cast<std::size_t>(g.dims[0] * g.dims[1]);
    const SliceSource source{
        g, volume.type(), [&](std::int64_t begin, std::int64_t end, void* samples) {
            std::copy_n(volume.samples<float>() + slice * static_cast<std::size_t>(begin),
                        slice * static_cast<std::size_t>(end - begin), static_cast<float*>(samples));
        }};
    const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
    extract_isosurface_in_slabs(source, 0.5, sink, {.slices = 5}, {.threads = threads, .progress = progress});
}

const Work kWorks[] = {
    {"extract_isosurface",
     [](const Volume& volume, int threads, const Progress& progress) {
         extract_isosurface(volume, 0.5, {.threads = threads, .progress = progress});
     }},
    {"snap",
     [](const Volume& volume, int threads, const Progress& progress) {
         extract_isosurface(volume, 0.5, {.snap = 0.3, .threads = threads, .progress = progress});
     }},
    {"IsosurfaceExtractor",
     [](const Volume& volume, int threads, const Progress& progress) {
         IsosurfaceExtractor(volume, {.threads = threads, .progress = progress}).extract(0.5, 1);
     }},
    {"extract_isosurface_in_slabs", extract_in_slabs},
    {"sweep_isovalues",
     [](const Volume& volume, int threads, const Progress& progress) {
         sweep_isovalues(volume, std::vector<double>{0, 0.5, 1}, {threads, progress});
     }},
    {"median_filter",
     [](const Volume& volume, int threads, const Progress& progress) {
         median_filter(volume, 1, {threads, progress});
     }},
    {"gaussian_filter",
     [](const Volume& volume, int threads, const Progress& progress) {
         gaussian_filter(volume, 1, {threads, progress});
     }},
    {"resample_isotropic",
     [](const Volume& volume, int threads, const Progress& progress) {
         resample_isotropic(volume, 0.7, {threads, progress});
     }},
};

TEST(Parallel, ProgressEndsAtOneWhereNothingIsToBeDone) {
    double last = 0;
    const Volume volume(Geometry{.dims = {3, 3, 3}}, SampleType::float32);
    resample_isotropic(volume, volume.geometry().spacing[0], {0, [&](double fraction) {
                                                                  last = fraction;
                                                                  return true;
                                                              }});
    EXPECT_EQ(last, 1);
}

TEST(Parallel, ProgressNeverDecreasesAndEndsAtOne) {
    for (const bool with_nan : {false, true}) {
        const Volume volume = blobs(with_nan);
        for (const Work& work : kWorks) {
            for (const int threads : {1, 0}) {
                double last = 0;
                work.run(volume, threads, [&](double fraction) {
                    EXPECT_GE(fraction, last) << work.name;
                    last = fraction;
                    return true;
                });
                EXPECT_EQ(last, 1) << work.name;
            }
        }
    }
}

// A loop that returns has done all its work, also where other work around it has failed meanwhile.
TEST(Parallel, LoopsWithinALoopThatFailsDoNotReturnEarly) {
    std::atomic<int> incomplete = 0;
    for (int round = 0; round < 200; ++round) {
        EXPECT_THROW(internal::parallel_for(0, 16,
                                            [&](int i) {
                                                if (i == 11) throw Cancelled();
                                                std::vector<char> done(4096);
                                                internal::parallel_for(0, 4096, [&](int k) { done[k] = 1; });
                                                incomplete += std::count(done.begin(), done.end(), 0) > 0;
                                            }),
                     Cancelled);
    }
    EXPECT_EQ(incomplete, 0);
}

TEST(Parallel, OneThreadIsTheCallers) {
    const Volume volume = blobs(false);
    for (const Work& work : kWorks) {
        std::set<std::thread::id> threads;
        work.run(volume, 1, [&](double) {
            threads.insert(std::this_thread::get_id());
            return true;
        });
        EXPECT_EQ(threads, std::set{std::this_thread::get_id()}) << work.name;
    }
}

TEST(Parallel, FalseFromProgressCancels) {
    const Volume volume = blobs(false);
    for (const Work& work : kWorks) {
        int calls = 0;
        EXPECT_THROW(work.run(volume, 0, [&](double) { return ++calls < 3; }), Cancelled) << work.name;
    }
}

}  // namespace
}  // namespace marrow::test
