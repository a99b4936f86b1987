// Extraction in slabs makes the same surface as extract_isosurface.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <limits>

#include <marrow/streaming.h>

#include "core/marching_cubes/ambiguous_cells.h"
#include "core/marching_cubes/classify.h"
#include "core/volume/sparse_array.h"
#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

SliceSource source_of(const Volume& volume) {
    const std::size_t slice = sample_size(volume.type()) *
                              static_cast<std::size_t>(volume.geometry().dims[0] * volume.geometry().dims[1]);
    return {volume.geometry(), volume.type(),
            [&volume, slice](std::int64_t begin, std::int64_t end, void* samples) {
                std::memcpy(
                    samples,
                    static_cast<const std::byte*>(volume.data()) + slice * static_cast<std::size_t>(begin),
                    slice * static_cast<std::size_t>(end - begin));
            }};
}

// Joins the parts, and checks that each has all points that its triangles name.
Mesh in_slabs(const SliceSource& source, double isovalue, const SlabLimits& limits,
              const IsosurfaceOptions& options) {
    Mesh mesh;
    std::uint64_t triangles_seen = 0;
    const SurfaceSink sink{
        [&](std::uint64_t points, std::uint64_t triangles, bool normals) {
            mesh.points.resize(points);
            mesh.normals.resize(normals ? points : 0);
            mesh.triangles.resize(triangles);
        },
        [&](const SurfacePart& part) {
            EXPECT_EQ(part.first_triangle, triangles_seen);
            triangles_seen += part.triangles.size();
            for (const Triangle& t : part.triangles) {
                for (const std::uint32_t p : t) {
                    EXPECT_GE(p, part.first_point);
                    EXPECT_LT(p, part.first_point + part.points.size());
                }
            }
            std::copy(part.points.begin(), part.points.end(),
                      mesh.points.begin() + static_cast<std::ptrdiff_t>(part.first_point));
            std::copy(part.normals.begin(), part.normals.end(),
                      mesh.normals.begin() + static_cast<std::ptrdiff_t>(part.first_point));
            std::copy(part.triangles.begin(), part.triangles.end(),
                      mesh.triangles.begin() + static_cast<std::ptrdiff_t>(part.first_triangle));
        }};
    extract_isosurface_in_slabs(source, isovalue, sink, limits, options);
    EXPECT_EQ(triangles_seen, mesh.triangles.size());
    return mesh;
}

template <class T>
Volume blobs(std::int64_t nz) {
    return sampled<T>(grid(90, 37, nz), [](auto x, auto y, auto z) {
        return 60 +
               50 * std::sin(0.3 * static_cast<double>(x)) * std::sin(0.4 * static_cast<double>(y)) *
                   std::cos(0.5 * static_cast<double>(z)) +
               static_cast<double>((x * 31 + y * 17 + z * 7) % 5);
    });
}

TEST(Streaming, AnyThicknessGivesTheSameBytes) {
    const Volume volumes[] = {blobs<std::uint8_t>(41), blobs<std::int16_t>(40), blobs<float>(3),
                              blobs<double>(1), blobs<float>(2)};
    for (const Volume& volume : volumes) {
        for (const bool closed : {false, true}) {
            for (const bool normals : {false, true}) {
                for (const bool topology : {false, true}) {
                    const IsosurfaceOptions options{
                        .normals = normals, .closed = closed, .topology = topology};
                    const std::uint64_t whole = mesh_hash(extract_isosurface(volume, 63, options));
                    for (const auto slices :
                         std::initializer_list<std::optional<std::int64_t>>{1, 2, 17, {}}) {
                        EXPECT_EQ(mesh_hash(in_slabs(source_of(volume), 63, {.slices = slices}, options)),
                                  whole)
                            << slices.value_or(0) << ' ' << closed << topology;
                    }
                }
            }
        }
    }
}

TEST(Streaming, LittleMemoryMakesManySlabsAndTooLittleIsRefused) {
    const Volume volume = blobs<std::int16_t>(60);
    const std::uint64_t whole = mesh_hash(extract_isosurface(volume, 63));
    EXPECT_EQ(mesh_hash(in_slabs(source_of(volume), 63, {.memory = 400'000}, {})), whole);
    const auto refusal = [&](std::size_t memory) -> std::string {
        try {
            in_slabs(source_of(volume), 63, {.memory = memory}, {});
        } catch (const LimitError& error) {
            return error.what();
        }
        return "none";
    };
    EXPECT_EQ(refusal(60'000),
              "limits.memory must be at least 1 MiB for this volume, and more for its surface");
    EXPECT_EQ(refusal(150'000), "limits.memory must be at least 1 MiB for this surface")
        << "a slice of the surface counts too";
    EXPECT_THROW(in_slabs(source_of(volume), 63, {.slices = 0}, {}), InputError);
    SliceSource source = source_of(volume);
    source.read_bytes = 1 << 20;
    EXPECT_THROW(in_slabs(source, 63, {.memory = 400'000}, {}), LimitError);
    EXPECT_EQ(mesh_hash(in_slabs(source, 63, {.memory = 400'000 + (1 << 20)}, {})), whole);
}

TEST(Streaming, SlicesThatAreStoredTogetherAreReadTogether) {
    const Volume volume = blobs<std::int16_t>(41);
    for (const std::int64_t together : {1, 7, 16, 41, 100}) {
        SliceSource source = source_of(volume);
        source.slices_at_once = together;
        std::int64_t read = 0, passes = 0;
        source.read = [&, read_slices = source.read](std::int64_t begin, std::int64_t end, void* samples) {
            passes += begin == 0;
            EXPECT_EQ(begin, begin == 0 ? 0 : read);
            EXPECT_TRUE(end == 41 || end % together == 0) << end;
            read = end;
            read_slices(begin, end, samples);
        };
        EXPECT_EQ(mesh_hash(in_slabs(source, 63, {.slices = 3}, {})),
                  mesh_hash(extract_isosurface(volume, 63)));
        EXPECT_EQ(passes, 2);
    }
}

TEST(Streaming, MoreSlicesTogetherThanThereAreTakeNoMoreMemory) {
    const Volume volume = blobs<std::uint8_t>(4);
    SliceSource source = source_of(volume);
    source.slices_at_once = std::numeric_limits<std::int64_t>::max();
    EXPECT_EQ(mesh_hash(in_slabs(source, 63, {.memory = 200'000}, {})),
              mesh_hash(extract_isosurface(volume, 63)));
}

// Empty slices but for one sample.
SliceSource almost_empty(std::int64_t nx, std::int64_t ny, std::int64_t nz) {
    SliceSource source;
    source.geometry.dims = {nx, ny, nz};
    source.type = SampleType::uint8;
    source.read = [nx, ny](std::int64_t begin, std::int64_t end, void* samples) {
        std::memset(samples, 0, static_cast<std::size_t>(nx * ny * (end - begin)));
        if (begin == 0) static_cast<std::uint8_t*>(samples)[nx + 1] = 100;
    };
    return source;
}

// What extraction says of a limit, in MiB.
std::string refusal(const SliceSource& source, std::size_t memory, std::size_t reserved) {
    const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
    try {
        extract_isosurface_in_slabs(source, 50, sink, {.memory = memory << 20, .reserved = reserved << 20},
                                    {.closed = true});
    } catch (const LimitError& error) {
        return error.what();
    }
    return "";
}

// Where pages begin to be huge, which takes more memory. The stated minimum leaves room for another run that
// has reserved a few MiB more.
TEST(Streaming, MoreMemoryIsNeverRefusedAndTheStatedMinimumSuffices) {
    const SliceSource source = almost_empty(2048, 2048, 8);
    for (const std::size_t reserved : {275u, 285u, 290u, 295u}) {
        const std::string text = refusal(source, 10, reserved);
        const std::size_t least = std::stoul(text.substr(text.find_first_of("0123456789")));
        EXPECT_NE(refusal(source, least - 5, reserved), "") << reserved;
        EXPECT_EQ(refusal(source, least, reserved + 3), "") << reserved;
        for (const std::size_t memory : {least, least + 1, std::max<std::size_t>(least, 319),
                                         std::max<std::size_t>(least, 320), least + 19, least + 40})
            EXPECT_EQ(refusal(source, memory, reserved), "") << reserved << ' ' << memory;
    }
}

// The arrays would be larger than any machine's memory.
TEST(Streaming, RefusesALimitBeforeItMakesArrays) {
    SliceSource source = almost_empty(1, 1 << 20, 1 << 20);
    source.read = [](auto, auto, auto) { FAIL() << "the arrays are there"; };
    const std::string text = refusal(source, 1024, 0);
    EXPECT_EQ(text.find("limits.memory must be at least"), 0u) << text;
}

// A slice has 4 MiB, and all of them are one slab.
TEST(Streaming, ReadsALargeSlabInPiecesAndStopsBetweenThem) {
    for (const std::int64_t together : {1, 3, 20}) {
        SliceSource source = almost_empty(2048, 2048, 40);
        source.slices_at_once = together;
        std::int64_t read = 0;
        source.read = [&, read_slices = source.read](std::int64_t begin, std::int64_t end, void* samples) {
            EXPECT_LE(end - begin, std::max<std::int64_t>(together, 16));
            EXPECT_TRUE(end == 40 || end % together == 0) << end;
            read += end - begin;
            read_slices(begin, end, samples);
        };
        const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
        const auto read_until_cancelled_after = [&](std::int64_t slices) {
            read = 0;
            EXPECT_THROW(extract_isosurface_in_slabs(
                             source, 50, sink, {.memory = std::size_t{2} << 30},
                             {.closed = true, .progress = [&](double) { return read < slices; }}),
                         Cancelled);
            return read;
        };
        EXPECT_LE(read_until_cancelled_after(1), std::max<std::int64_t>(together, 16));
        EXPECT_LE(read_until_cancelled_after(41), 40 + std::max<std::int64_t>(together, 16))
            << "second reading";
    }
}

// The volume is read as one piece, and is one slab.
TEST(Streaming, ReportsProgressWhileItWorksOnASlab) {
    const Volume volume = blobs<std::int16_t>(41);
    for (const bool topology : {false, true}) {
        SliceSource source = source_of(volume);
        std::vector<int> reports;  // after each reading
        source.read = [&, read_slices = source.read](std::int64_t begin, std::int64_t end, void* samples) {
            reports.push_back(0);
            read_slices(begin, end, samples);
        };
        const SurfaceSink sink{[](auto, auto, auto) {}, [&](const SurfacePart&) { reports.push_back(0); }};
        double last = 0;
        const auto progress = [&](double fraction) {
            EXPECT_GE(fraction, last);
            last = fraction;
            ++reports.back();
            return true;
        };
        extract_isosurface_in_slabs(source, 63, sink, {}, {.topology = topology, .progress = progress});
        ASSERT_EQ(reports.size(), 3u);
        EXPECT_GE(reports[0], 1 + 2 * 41) << "each slice is classified, and counted";
        EXPECT_GE(reports[1], 1 + 41 * (topology ? 2 : 1) + 2 * 4)
            << "each slice is classified, and shares are emitted";
        EXPECT_EQ(last, 1);
    }
}

TEST(Streaming, TheSinkMayAskHowManySamplesAreNotFinite) {
    Volume volume = blobs<float>(20);
    for (const std::size_t at : {5u, 777u, 60'000u})
        volume.samples<float>()[at] = std::numeric_limits<float>::quiet_NaN();
    IsosurfaceStats stats;
    std::int64_t at_begin = 0;
    const SurfaceSink sink{[&](auto, auto, auto) { at_begin = stats.non_finite_samples; },
                           [](const SurfacePart&) {}};
    extract_isosurface_in_slabs(source_of(volume), 63, sink, {.slices = 3}, {}, &stats);
    EXPECT_EQ(at_begin, 3);
    EXPECT_EQ(stats.non_finite_samples, 3);
}

// All of the samples, or a single one.
TEST(Streaming, RefusesSamplesThatChangeBetweenTheReadings) {
    const Volume first = checkerboard(24);
    const auto read_then = [&](const Volume& second) {
        SliceSource source = source_of(first);
        int readings = 0;
        source.read = [&, readings](std::int64_t begin, std::int64_t end, void* samples) mutable {
            readings += begin == 0;
            source_of(readings == 1 ? first : second).read(begin, end, samples);
        };
        return source;
    };
    for (const bool topology : {false, true}) {
        const IsosurfaceOptions options{.topology = topology};
        const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
        Volume other = sampled<std::uint8_t>(grid(24, 24, 24), [](auto, auto, auto) { return 0; });
        EXPECT_NO_THROW(extract_isosurface_in_slabs(read_then(first), 0.5, sink, {.slices = 3}, options));
        EXPECT_THROW(extract_isosurface_in_slabs(read_then(other), 0.5, sink, {.slices = 3}, options),
                     InputError);
        other = checkerboard(24);
        std::uint8_t& last = other.samples<std::uint8_t>()[24 * 24 * 24 - 1];
        last = last == 0 ? 1 : 0;
        EXPECT_THROW(extract_isosurface_in_slabs(read_then(other), 0.5, sink, {.slices = 3}, options),
                     InputError);
    }
}

// The samples stay on their sides of the isovalue, and decide the cells otherwise.
TEST(Streaming, RefusesSamplesThatDecideTheTopologyOtherwise) {
    const Volume volume = checkerboard(12);
    SliceSource source = source_of(volume);
    int readings = 0;
    source.read = [&](std::int64_t begin, std::int64_t end, void* samples) {
        readings += begin == 0;
        source_of(volume).read(begin, end, samples);
        const std::span bytes(static_cast<std::uint8_t*>(samples),
                              static_cast<std::size_t>(12 * 12 * (end - begin)));
        for (std::uint8_t& sample : bytes) sample = sample != 0 ? readings == 1 ? 11 : 200 : 0;
    };
    const SurfaceSink sink{[](auto, auto, auto) {}, [](const SurfacePart&) {}};
    EXPECT_NO_THROW(extract_isosurface_in_slabs(source, 10, sink, {.slices = 3}));
    readings = 0;
    EXPECT_THROW(extract_isosurface_in_slabs(source, 10, sink, {.slices = 3}, {.topology = true}),
                 InputError);
}

TEST(Streaming, ForgottenCellsTakeNoMemory) {
    using namespace internal;
    const Volume volume = checkerboard(20);
    const VolumeView view = volume;
    const IndexToPhysical to_physical(view);
    InsideBits bits(view.geometry.dims, ClosedSides{});
    for (std::int64_t z = 0; z < bits.nz; ++z) classify_slice(view, 0.5, z, bits, nullptr);
    RowCounts rows(bits.rows());
    ActiveWords active(bits);
    AmbiguousCells cells(view, 0.5, to_physical, bits);
    for (std::int64_t z = 0; z < bits.nz; ++z) cells.count(z, rows, active);
    const std::size_t with_cells = cells.bytes();
    for (std::int64_t z = 0; z < bits.nz; ++z) cells.forget(z);
    EXPECT_LE(cells.bytes() + 19 * 19 * 19 * sizeof(AmbiguousCell), with_cells);
    EXPECT_TRUE(cells.find_again(3, active));
}

// The pages before an element that are in memory.
template <class T>
std::size_t pages_before(internal::SparseArray<T>& array, std::size_t end) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t pages = end * sizeof(T) / page;
    std::vector<unsigned char> resident(pages);
    EXPECT_EQ(mincore(array.data(), pages * page, resident.data()), 0);
    return static_cast<std::size_t>(std::count_if(resident.begin(), resident.end(),
                                                  [](unsigned char flags) { return (flags & 1) != 0; }));
}

// Parts of 3 MiB overlap, and none begins at a page.
TEST(Streaming, NoPageBeforeTheReleasedElementsStaysInMemory) {
    for (const bool huge : {false, true}) {
        constexpr std::size_t kSize = (3 << 20) + 12345;
        internal::SparseArray<char> array(20 * kSize);
        array.use_huge_pages(huge);
        for (std::size_t begin = 0; begin < 19 * kSize; begin += kSize) {
            const std::size_t end = begin + kSize + 5000;
            std::fill(array.data() + begin, array.data() + end, char{1});
            array.release(begin, end);
            ASSERT_EQ(pages_before(array, end), 0u) << huge << ' ' << begin;
            EXPECT_EQ(array.data()[end], 0);
        }
    }
}

TEST(Streaming, AnExceptionOfTheSourceEndsTheWork) {
    const Volume volume = blobs<std::int16_t>(30);
    SliceSource source = source_of(volume);
    const auto read = source.read;
    source.read = [&](std::int64_t begin, std::int64_t end, void* samples) {
        if (end > 20) throw IoError("gone");
        read(begin, end, samples);
    };
    const SurfaceSink sink{[](auto, auto, auto) { FAIL() << "the size is not known yet"; },
                           [](const SurfacePart&) {}};
    EXPECT_THROW(extract_isosurface_in_slabs(source, 63, sink, {.slices = 4}), IoError);
}

// With more than 2^31 samples, all indices must have 64 bits. Only a few slices are in memory at a time.
TEST(Streaming, MoreThanTwoToThe31Samples) {
    SliceSource source;
    source.geometry.dims = {2048, 1024, 1030};
    source.type = SampleType::uint8;
    const std::size_t slice = 2048 * 1024;
    source.read = [&](std::int64_t begin, std::int64_t end, void* samples) {
        std::memset(samples, 0, slice * static_cast<std::size_t>(end - begin));
        // One bright sample near the end of the volume.
        if (begin <= 1027 && 1027 < end) {
            static_cast<std::uint8_t*>(
                samples)[slice * static_cast<std::size_t>(1027 - begin) + 1000 * 2048 + 2000] = 200;
        }
    };
    Mesh mesh;
    const SurfaceSink sink{[&](auto, auto, auto) {},
                           [&](const SurfacePart& part) {
                               if (part.triangles.empty()) return;
                               mesh.points.assign(part.points.begin(), part.points.end());
                               mesh.triangles.assign(part.triangles.begin(), part.triangles.end());
                           }};
    extract_isosurface_in_slabs(source, 100, sink, {.memory = std::size_t{100} << 20}, {.closed = true});
    EXPECT_EQ(mesh.points.size(), 6u);
    EXPECT_EQ(manifold_fault(mesh), "");
    for (const Vec3f& p : mesh.points) {
        EXPECT_NEAR(p[0], 2000, 0.51);
        EXPECT_NEAR(p[1], 1000, 0.51);
        EXPECT_NEAR(p[2], 1027, 0.51);
    }
}

}  // namespace
}  // namespace marrow::test
