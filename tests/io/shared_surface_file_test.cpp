// Files that several processes write parts of a surface to.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>
#include <vector>

#include <marrow/error.h>
#include <marrow/isosurface.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>

#include "support/fields.h"
#include "support/temporary_folder.h"

namespace marrow::test {
namespace {

constexpr double kIsovalue = 2;

// The parts of a volume that is cut across all axes.
std::vector<NumberedPart> cut_up(const Volume& volume, const IsosurfaceOptions& options, SurfaceSize& size) {
    const auto& dims = volume.geometry().dims;
    std::vector<VolumeView> views;
    for (const std::int64_t z : {0, 5}) {
        for (const std::int64_t y : {0, 7}) {
            for (const std::int64_t x : {0, 3})
                views.push_back(
                    part_of(volume, {x, y, z},
                            {x == 0 ? 4 : dims[0] - 3, y == 0 ? 8 : dims[1] - 7, z == 0 ? 6 : dims[2] - 5}));
        }
    }
    std::vector<PartCounts> counts;
    for (const VolumeView& view : views) {
        counts.push_back(count_part(view, dims, kIsovalue, options));
        size.points += counts.back().total().points;
        size.triangles += counts.back().total().triangles;
    }
    const std::vector<PartNumbers> numbers = number_parts(counts);
    std::vector<NumberedPart> parts;
    for (std::size_t p = 0; p < views.size(); ++p)
        parts.push_back(extract_numbered_part(views[p], numbers[p], kIsovalue, options));
    return parts;
}

Volume noise(Random& random) {
    return sampled<std::uint8_t>(grid(9, 11, 10), [&](auto, auto, auto) { return random() % 5; });
}

// Two threads write, which share nothing but the name of the file, as processes would. They write in any
// order, and some parts twice, as after a process that was killed. A forked process could wait for ever for
// threads of oneTBB that it has not.
TEST(SharedSurfaceFile, HasTheBytesOfWriteMesh) {
    Random random(7);
    const Volume volume = noise(random);
    for (const bool topology : {false, true}) {
        Mesh mesh = extract_isosurface(volume, kIsovalue, {.closed = true, .topology = topology});
        ASSERT_GT(turn_normals_outward(mesh), 5u);  // by writers
    }
    for (const char* name : {"surface.ply", "surface.stl"}) {
        for (const Space space : {Space::LPS, Space::RAS, Space::none}) {
            for (const int kind : {0, 1, 2, 3}) {
                const bool normals = kind % 2 == 0, topology = kind / 2 == 1;
                const IsosurfaceOptions extraction{.normals = normals, .closed = true, .topology = topology};
                SurfaceSize size;
                std::vector<NumberedPart> parts = cut_up(volume, extraction, size);
                std::shuffle(parts.begin(), parts.end(), random);
                const TemporaryFolder folder;
                MeshWriteOptions options;
                options.space = space;
                SharedSurfaceWriter writer(folder / name, size, normals, options);
                std::thread other([&] {
                    for (std::size_t p = 0; p < 5; ++p) write_part(writer.file(), parts[p]);
                });
                for (std::size_t p = 3; p < parts.size(); ++p) write_part(writer.file(), parts[p]);
                other.join();
                writer.commit();
                write_mesh(extract_isosurface(volume, kIsovalue, extraction), folder / "whole" += name,
                           options);
                EXPECT_EQ(read_file(folder / name), read_file(folder / "whole" += name));
                EXPECT_EQ(folder.files().size(), 2u);
            }
        }
    }
}

TEST(SharedSurfaceFile, LeavesTheOldFileUntilItIsComplete) {
    Random random(8);
    const TemporaryFolder folder;
    const auto output = write_file(folder / "surface.ply", "old");
    {
        SurfaceSize size;
        const auto parts = cut_up(noise(random), {}, size);
        const SharedSurfaceWriter writer(output, size, true);
        write_part(writer.file(), parts[0]);
        EXPECT_EQ(read_file(output), "old");
    }
    EXPECT_EQ(read_file(output), "old");
    EXPECT_EQ(folder.files().size(), 1u);
}

TEST(SharedSurfaceFile, MayBeEmpty) {
    const TemporaryFolder folder;
    for (const char* name : {"empty.ply", "empty.stl"}) {
        SharedSurfaceWriter(folder / name, {}, true).commit();
        write_mesh(Mesh(), folder / "whole" += name, {});
    }
    EXPECT_EQ(read_file(folder / "empty.stl"), read_file(folder / "wholeempty.stl"));
    EXPECT_EQ(read_mesh(folder / "empty.ply").points.size(), 0u);
}

TEST(SharedSurfaceFile, RefusesWhatDoesNotFit) {
    Random random(9);
    const TemporaryFolder folder;
    SurfaceSize size;
    const auto parts = cut_up(noise(random), {}, size);
    EXPECT_THROW(SharedSurfaceWriter(folder / "surface.obj", size, true), InputError);
    EXPECT_THROW(SharedSurfaceWriter(folder / "surface.ply.gz", size, true), InputError);
    EXPECT_THROW(SharedSurfaceWriter(folder / "surface.stl", {1, std::uint64_t{1} << 32}, true), LimitError);
    EXPECT_THROW(SharedSurfaceWriter(folder / "surface.ply", {std::uint64_t{1} << 32, 1}, true), LimitError);
    SharedSurfaceWriter smaller(folder / "surface.ply", {size.points - 1, size.triangles}, true);
    EXPECT_THROW(write_part(smaller.file(), parts.back()), InputError);
    SharedSurfaceWriter without_normals(folder / "surface.ply", size, false);
    EXPECT_THROW(write_part(without_normals.file(), parts[0]), InputError);
    SharedSurfaceFile missing = without_normals.file();
    missing.normals = true;
    missing.temporary = folder / "missing";
    EXPECT_THROW(write_part(missing, parts[0]), IoError);
}

}  // namespace
}  // namespace marrow::test
