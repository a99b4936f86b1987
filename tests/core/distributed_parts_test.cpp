// Surfaces that are extracted in parts and put together have the bytes of the surface of the whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include <marrow/error.h>
#include <marrow/normals.h>
#include <marrow/parts.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using Index = std::array<std::int64_t, 3>;

struct Box {
    Index begin, dims;
};

// The view that a process has of a part: samples of its own, with no more than one around it on each side.
struct OwnSamples {
    OwnSamples(const VolumeView& whole, const Box& box, bool halo) {
        view = part_of(whole, box.begin, box.dims);
        std::size_t offset = 0, step = 1;
        Index stored;
        for (std::size_t a = 0; a < 3; ++a) {
            view.below[a] = std::min<std::int64_t>(view.below[a], halo);
            view.above[a] = std::min<std::int64_t>(view.above[a], halo);
            stored[a] = view.below[a] + box.dims[a] + view.above[a];
            offset += step * static_cast<std::size_t>(view.below[a]);
            step *= static_cast<std::size_t>(stored[a]);
        }
        const std::size_t bytes = sample_size(whole.type);
        samples.resize(step * bytes);
        const auto row = static_cast<std::size_t>(stored[0]) * bytes;
        std::size_t to = 0;
        for (std::int64_t z = -view.below[2]; z < box.dims[2] + view.above[2]; ++z) {
            for (std::int64_t y = -view.below[1]; y < box.dims[1] + view.above[1]; ++y, to += row) {
                const std::int64_t from = z * view.slice_pitch() + y * view.row_pitch() - view.below[0];
                std::memcpy(
                    samples.data() + to,
                    static_cast<const std::byte*>(view.data) + from * static_cast<std::int64_t>(bytes), row);
            }
        }
        view.data = samples.data() + offset * bytes;
        view.pitch = {stored[0], stored[0] * stored[1]};
    }

    std::vector<std::byte> samples;
    VolumeView view;
};

// Gives each chunk that does not matter to a part's surface one value, and returns the number of samples that
// change.
std::size_t fill_chunks_without_surface(OwnSamples& own, const Index& whole, const Index& chunk,
                                        double isovalue, const IsosurfaceOptions& options) {
    const std::vector<std::uint8_t> flags = chunks_without_surface(own.view, whole, chunk, isovalue, options);
    const VolumeView& view = own.view;
    const std::size_t bytes = sample_size(view.type);
    Index begin, end, first_chunk, chunks;
    for (std::size_t a = 0; a < 3; ++a) {
        begin[a] = view.first[a] - view.below[a];
        end[a] = view.first[a] + view.geometry.dims[a] + view.above[a];
        first_chunk[a] = begin[a] / chunk[a];
        chunks[a] = (end[a] - 1) / chunk[a] + 1 - first_chunk[a];
    }
    EXPECT_EQ(flags.size(), static_cast<std::size_t>(chunks[0] * chunks[1] * chunks[2]));
    std::vector<const std::byte*> values(flags.size());  // of each chunk
    std::size_t changed = 0;
    std::byte* sample = own.samples.data();
    for (std::int64_t z = begin[2]; z < end[2]; ++z) {
        for (std::int64_t y = begin[1]; y < end[1]; ++y) {
            for (std::int64_t x = begin[0]; x < end[0]; ++x, sample += bytes) {
                const auto c = static_cast<std::size_t>(
                    ((z / chunk[2] - first_chunk[2]) * chunks[1] + y / chunk[1] - first_chunk[1]) *
                        chunks[0] +
                    x / chunk[0] - first_chunk[0]);
                if (flags[c] == 0) continue;
                if (values[c] == nullptr) values[c] = sample;
                if (std::memcmp(sample, values[c], bytes) != 0) ++changed;
                std::memcpy(sample, values[c], bytes);
            }
        }
    }
    return changed;
}

// The cuts across an axis of n samples: where parts begin, and the last sample.
std::vector<std::int64_t> random_cuts(std::int64_t n, Random& random) {
    std::vector<std::int64_t> cuts{0, n - 1};
    for (std::int64_t i = 1; i < n - 1; ++i)
        if (random() % 3 == 0) cuts.push_back(i);
    std::sort(cuts.begin(), cuts.end());
    return cuts;
}

std::vector<Box> cut_by_planes(const Index& dims, Random& random, int cut_axes) {
    std::vector<std::int64_t> cuts[3];
    for (std::size_t a = 0; a < 3; ++a)
        cuts[a] =
            cut_axes >> a & 1 ? random_cuts(dims[a], random) : std::vector<std::int64_t>{0, dims[a] - 1};
    std::vector<Box> boxes;
    for (std::size_t z = 0; z + 1 < cuts[2].size(); ++z) {
        for (std::size_t y = 0; y + 1 < cuts[1].size(); ++y) {
            for (std::size_t x = 0; x + 1 < cuts[0].size(); ++x) {
                boxes.push_back({{cuts[0][x], cuts[1][y], cuts[2][z]},
                                 {cuts[0][x + 1] - cuts[0][x] + 1, cuts[1][y + 1] - cuts[1][y] + 1,
                                  cuts[2][z + 1] - cuts[2][z] + 1}});
            }
        }
    }
    return boxes;
}

// Cuts a box in two at a random place, and each half again, so that cuts end at other cuts.
void cut_anyhow(const Box& box, Random& random, std::vector<Box>& boxes) {
    const std::size_t axis = random() % 3;
    if (box.dims[axis] < 3 || random() % 5 == 0) return boxes.push_back(box);
    const auto at = 1 + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(box.dims[axis] - 2));
    Box low = box, high = box;
    low.dims[axis] = at + 1;
    high.begin[axis] += at;
    high.dims[axis] -= at;
    cut_anyhow(low, random, boxes);
    cut_anyhow(high, random, boxes);
}

bool same_bytes(const Mesh& a, const Mesh& b) {
    const auto same = [](const auto& p, const auto& q) {
        return p.size() == q.size() &&
               (p.empty() || std::memcmp(p.data(), q.data(), p.size() * sizeof p[0]) == 0);
    };
    return same(a.points, b.points) && same(a.normals, b.normals) && same(a.triangles, b.triangles);
}

Mesh merged(const VolumeView& whole, const std::vector<Box>& boxes, double isovalue,
            const IsosurfaceOptions& options) {
    std::vector<PartSurface> parts;
    for (const Box& box : boxes)
        parts.push_back(extract_part(OwnSamples(whole, box, options.normals).view, whole.geometry.dims,
                                     isovalue, options));
    return merge_parts(parts);
}

// Returns the samples that a part is extracted from.
using Reread = std::function<OwnSamples(const Box&)>;

// Counts the parts, numbers those between two cuts across z at a time, and writes each to its place. If
// `outward`, each part turns its normals outward.
Mesh assembled(const VolumeView& whole, const std::vector<Box>& boxes, double isovalue,
               const IsosurfaceOptions& options, bool outward = false, const Reread& reread = {}) {
    const Index& dims = whole.geometry.dims;
    std::vector<std::vector<PartCounts>> layers;
    std::int64_t z = -1;
    for (const Box& box : boxes) {  // in the order of z
        if (std::exchange(z, box.begin[2]) != box.begin[2]) layers.emplace_back();
        layers.back().push_back(count_part(OwnSamples(whole, box, false).view, dims, isovalue, options));
    }
    std::vector<PartNumbers> numbers;
    SurfaceSize size;
    for (std::size_t l = 0; l < layers.size(); ++l) {
        std::vector<PartCounts> next;
        if (l + 1 < layers.size())
            for (const PartCounts& counts : layers[l + 1]) next.push_back(first_slice(counts));
        for (PartNumbers& n : number_parts(layers[l], next, size)) numbers.push_back(std::move(n));
        for (const PartCounts& counts : layers[l]) {
            size.points += counts.total().points;
            size.triangles += counts.total().triangles;
        }
    }
    Mesh mesh;
    mesh.points.resize(size.points, Vec3f{-1, -2, -3});
    mesh.normals.resize(options.normals ? size.points : 0);
    mesh.triangles.resize(size.triangles);
    std::size_t written = 0;
    for (std::size_t p = 0; p < boxes.size(); ++p) {
        const OwnSamples own = reread ? reread(boxes[p]) : OwnSamples(whole, boxes[p], options.normals);
        NumberedPart part = extract_numbered_part(own.view, numbers[p], isovalue, options);
        if (outward) turn_normals_outward(part.mesh);
        for (const NumberedRun& run : part.points) {
            for (std::size_t i = 0; i < run.count; ++i, ++written) {
                EXPECT_EQ(part.numbers[run.begin + i], run.number + i);
                mesh.points.at(run.number + i) = part.mesh.points.at(run.begin + i);
                if (options.normals) mesh.normals.at(run.number + i) = part.mesh.normals.at(run.begin + i);
            }
        }
        for (const NumberedRun& run : part.triangles) {
            for (std::size_t i = 0; i < run.count; ++i) {
                const Triangle& t = part.mesh.triangles.at(run.begin + i);
                mesh.triangles.at(run.number + i) = {part.numbers.at(t[0]), part.numbers.at(t[1]),
                                                     part.numbers.at(t[2])};
            }
        }
    }
    EXPECT_EQ(written, size.points);  // each point is owned by one part
    return mesh;
}

// Oblique, anisotropic and, at random, mirrored.
Geometry random_geometry(Random& random) {
    std::uniform_int_distribution<std::int64_t> side(2, 9);
    Geometry g = grid(side(random) + (random() % 4 == 0 ? 56 + static_cast<std::int64_t>(random() % 80) : 0),
                      side(random), side(random));
    g.spacing = {0.7, 0.9, 1.3};
    g.origin = {-113.7, 41.3, 207.9};
    g.direction = {{{0.8, -0.6, 0}, {0.6, 0.8, 0}, {0, 0, random() % 2 == 0 ? 1.0 : -1.0}}};
    return g;
}

// Noise of few values, so that some equal the isovalue 2.
template <class T>
Volume noise(Random& random) {
    return sampled<T>(random_geometry(random), [&](auto, auto, auto) { return random() % 5; });
}

// The same, but most neighbours are on different sides, so that many cells are ambiguous and some have
// tunnels.
template <class T>
Volume alternating_noise(Random& random) {
    return sampled<T>(random_geometry(random), [&](auto x, auto y, auto z) {
        const bool inside = (x + y + z) % 2 == (random() % 5 == 0 ? 1 : 0);
        return inside ? 2 + random() % 3 : random() % 2;
    });
}

template <class T>
class DistributedParts : public testing::Test {};

using SampleTypes =
    testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::int32_t, float, double>;
TYPED_TEST_SUITE(DistributedParts, SampleTypes);

TYPED_TEST(DistributedParts, HaveTheBytesOfTheWhole) {
    Random random(4);
    std::size_t parts = 0;
    for (int i = 0; i < 60; ++i) {
        const Volume volume = noise<TypeParam>(random);
        const IsosurfaceOptions options{.normals = i % 4 != 0, .closed = i % 2 == 0, .threads = 1 + i % 2};
        const Mesh whole = extract_isosurface(volume, 2, options);
        const std::vector<Box> planes = cut_by_planes(volume.geometry().dims, random, 1 + i % 7);
        ASSERT_TRUE(same_bytes(assembled(volume, planes, 2, options), whole)) << i;
        std::vector<Box> anyhow;
        cut_anyhow({{0, 0, 0}, volume.geometry().dims}, random, anyhow);
        std::shuffle(anyhow.begin(), anyhow.end(), random);
        ASSERT_TRUE(same_bytes(merged(volume, anyhow, 2, options), whole)) << i;
        parts += planes.size() + anyhow.size();
    }
    EXPECT_GT(parts, 1000u);
}

// With exact topology, also the points inside cells, at cuts and between them.
TYPED_TEST(DistributedParts, WithExactTopologyHaveTheBytesOfTheWhole) {
    Random random(10);
    std::size_t cells = 0, tunnels = 0;
    for (int i = 0; i < 60; ++i) {
        const Volume volume = i % 3 == 0 ? noise<TypeParam>(random) : alternating_noise<TypeParam>(random);
        const Index& dims = volume.geometry().dims;
        const IsosurfaceOptions options{
            .normals = i % 4 != 0, .closed = i % 2 == 0, .topology = true, .threads = 1 + i % 2};
        const Mesh whole = extract_isosurface(volume, 2, options);
        const std::vector<Box> planes = cut_by_planes(dims, random, 1 + i % 7);
        ASSERT_TRUE(same_bytes(assembled(volume, planes, 2, options), whole)) << i;
        std::vector<Box> anyhow;
        cut_anyhow({{0, 0, 0}, dims}, random, anyhow);
        std::shuffle(anyhow.begin(), anyhow.end(), random);
        ASSERT_TRUE(same_bytes(merged(volume, anyhow, 2, options), whole)) << i;
        for (const std::uint64_t key : extract_part(volume, dims, 2, options).keys) {
            const auto nx = static_cast<std::uint64_t>(dims[0] + (options.closed ? 2 : 0));
            if (key % (9 * nx) < 3 * nx) continue;
            const std::uint64_t number = (key % (9 * nx) - 3 * nx) % 6;
            cells += number == 0 ? 1 : 0;
            tunnels += number == 5 ? 1 : 0;
        }
    }
    EXPECT_GT(cells - tunnels, 1000u);
    EXPECT_GT(tunnels, 50u);
}

// A point has the same key in any part, and different points have different ones.
TEST(DistributedPartsTest, KeysDoNotDependOnTheCuts) {
    Random random(11);
    for (int i = 0; i < 60; ++i) {
        const Volume volume = alternating_noise<std::int16_t>(random);
        const Index& dims = volume.geometry().dims;
        const IsosurfaceOptions options{.closed = i % 2 == 0, .topology = i % 3 != 0, .threads = 1};
        const PartSurface whole = extract_part(volume, dims, 2, options);
        ASSERT_EQ(std::adjacent_find(whole.keys.begin(), whole.keys.end(), std::greater_equal<>()),
                  whole.keys.end());
        ASSERT_TRUE(whole.keys.empty() || whole.keys.back() < whole.key_count());
        std::vector<Box> boxes;
        cut_anyhow({{0, 0, 0}, dims}, random, boxes);
        std::size_t found = 0;
        for (const Box& box : boxes) {
            const OwnSamples own(volume, box, true);
            const PartSurface part = extract_part(own.view, dims, 2, options);
            for (std::size_t p = 0; p < part.keys.size(); ++p, ++found) {
                const auto at = std::lower_bound(whole.keys.begin(), whole.keys.end(), part.keys[p]);
                ASSERT_TRUE(at != whole.keys.end() && *at == part.keys[p]) << i;
                const auto q = static_cast<std::size_t>(at - whole.keys.begin());
                ASSERT_EQ(bits_of(part.mesh.points[p]), bits_of(whole.mesh.points[q])) << i;
                ASSERT_EQ(bits_of(part.mesh.normals[p]), bits_of(whole.mesh.normals[q])) << i;
            }
        }
        ASSERT_GE(found, whole.keys.size()) << i;
    }
}

TEST(DistributedPartsTest, DifficultCellsHaveTheBytesOfTheWhole) {
    Random random(5);
    for (int i = 0; i < 300; ++i) {
        const auto [volume, isovalue] = random_grid(random);
        const std::vector<Box> boxes = cut_by_planes(volume.geometry().dims, random, 7);
        for (const bool topology : {false, true}) {
            const IsosurfaceOptions options{.closed = i % 2 == 0, .topology = topology, .threads = 1};
            const Mesh whole = extract_isosurface(volume, isovalue, options);
            ASSERT_TRUE(same_bytes(assembled(volume, boxes, isovalue, options), whole)) << i;
            ASSERT_TRUE(same_bytes(merged(volume, boxes, isovalue, options), whole)) << i;
        }
    }
}

// Thin walls at the borders of parts, where the triangles around a point are in several parts.
TEST(DistributedPartsTest, TurnTheNormalsOutwardThatTheWholeTurns) {
    Random random(8);
    for (const bool topology : {false, true}) {
        std::size_t turned = 0;
        for (int i = 0; i < 100; ++i) {
            const Volume volume = noise<std::uint8_t>(random);
            const IsosurfaceOptions options{.closed = i % 2 == 0, .topology = topology, .threads = 1};
            Mesh whole = extract_isosurface(volume, 2, options);
            turned += turn_normals_outward(whole);
            const std::vector<Box> boxes = cut_by_planes(volume.geometry().dims, random, 1 + i % 7);
            ASSERT_TRUE(same_bytes(assembled(volume, boxes, 2, options, true), whole)) << i;
        }
        EXPECT_GT(turned, 1000u);
    }
}

// Blobs, whose samples matter near the surface alone.
TYPED_TEST(DistributedParts, ChunksWithoutSurfaceNeedNotBeReadAgain) {
    Random random(9);
    std::size_t changed = 0, all = 0;
    for (int i = 0; i < 60; ++i) {
        Geometry geometry = random_geometry(random);
        for (std::int64_t& n : geometry.dims)
            n = 4 + static_cast<std::int64_t>(random() % (n > 60 ? 120 : 16));
        const double scale = 2 + static_cast<double>(random() % 5);
        const Volume volume = sampled<TypeParam>(geometry, [&](double x, double y, double z) {
            // Some of the samples equal the isovalue.
            return std::round(50 + 20 * (std::sin(x / scale) + std::sin(y / scale) + std::sin(z / scale)));
        });
        const double isovalue = 20 + static_cast<double>(random() % 60);
        const IsosurfaceOptions options{
            .normals = i % 4 != 0, .closed = i % 2 == 0, .topology = i % 5 == 0, .threads = 1};
        const Index& dims = volume.geometry().dims;
        Index chunk;
        for (std::int64_t& n : chunk) n = 1 + static_cast<std::int64_t>(random() % 8);
        const auto reread = [&](const Box& box) {
            OwnSamples own(volume, box, options.normals);
            changed += fill_chunks_without_surface(own, dims, chunk, isovalue, options);
            all += own.samples.size() / sizeof(TypeParam);
            return own;
        };
        const bool outward = options.normals && i % 3 == 0;
        Mesh whole = extract_isosurface(volume, isovalue, options);
        if (outward) turn_normals_outward(whole);
        const std::vector<Box> boxes = cut_by_planes(dims, random, 1 + i % 7);
        ASSERT_TRUE(same_bytes(assembled(volume, boxes, isovalue, options, outward, reread), whole)) << i;
    }
    EXPECT_GT(changed, all / 10);
}

// Drops of noise, with cells that the samples decide beside chunks without surface.
TEST(DistributedPartsTest, ChunksWithoutSurfaceDecideNothing) {
    Random random(12);
    std::size_t changed = 0, inner = 0;
    for (int i = 0; i < 60; ++i) {
        Geometry geometry = random_geometry(random);
        geometry.dims = {40, 20, 18};
        const Volume volume = sampled<std::int16_t>(geometry, [&](double x, double y, double z) {
            const bool is_drop = std::fmod(x, 13) < 5 && std::fmod(y, 11) < 4 && std::fmod(z, 9) < 4;
            return is_drop ? static_cast<int>(random() % 4) : static_cast<int>(random() % 2);
        });
        const IsosurfaceOptions options{.closed = i % 2 == 0, .topology = true, .threads = 1};
        const Index chunk{1 + i % 5, 1 + i % 4, 1 + i % 3};
        const auto reread = [&](const Box& box) {
            OwnSamples own(volume, box, true);
            changed += fill_chunks_without_surface(own, geometry.dims, chunk, 2, options);
            return own;
        };
        const Mesh whole = extract_isosurface(volume, 2, options);
        inner +=
            whole.points.size() - extract_isosurface(volume, 2, {.closed = options.closed}).points.size();
        const std::vector<Box> boxes = cut_by_planes(geometry.dims, random, 1 + i % 7);
        ASSERT_TRUE(same_bytes(assembled(volume, boxes, 2, options, false, reread), whole)) << i;
    }
    EXPECT_GT(changed, 100'000u);
    EXPECT_GT(inner, 1000u);
}

// A single slice has a closed surface, and no open one.
TEST(DistributedPartsTest, FlatVolumesHaveTheBytesOfTheWhole) {
    Random random(6);
    for (const Index& dims : {Index{7, 6, 1}, Index{1, 9, 8}, Index{130, 1, 1}, Index{1, 1, 1}}) {
        const Volume volume = sampled<std::uint8_t>(grid(dims[0], dims[1], dims[2]),
                                                    [&](auto, auto, auto) { return random() % 5; });
        for (const bool closed : {false, true}) {
            for (const bool topology : {false, true}) {
                const IsosurfaceOptions options{.closed = closed, .topology = topology};
                const Mesh whole = extract_isosurface(volume, 2, options);
                const std::vector<Box> boxes{{{0, 0, 0}, dims}};
                ASSERT_TRUE(same_bytes(assembled(volume, boxes, 2, options), whole));
                ASSERT_TRUE(same_bytes(merged(volume, boxes, 2, options), whole));
            }
        }
    }
}

TEST(DistributedPartsTest, RefusesWhatCannotGiveTheBytesOfTheWhole) {
    const Volume volume = checkerboard(8);
    const Index whole{8, 8, 8};
    VolumeView part = part_of(volume, {0, 0, 0}, {4, 8, 8});
    EXPECT_THROW(extract_part(part, whole, 0.5, {.snap = 0.3}), InputError);
    EXPECT_THROW(extract_part(part, {3, 8, 8}, 0.5), InputError);
    part.above[0] = 0;  // so normals would differ
    EXPECT_THROW(extract_part(part, whole, 0.5), InputError);
    EXPECT_NO_THROW(extract_part(part, whole, 0.5, {.normals = false}));
    EXPECT_NO_THROW(count_part(part, whole, 0.5));

    const auto open = extract_part(volume, whole, 0.5),
               closed = extract_part(volume, whole, 0.5, {.closed = true});
    EXPECT_THROW(merge_parts(std::vector{open, closed}), InputError);
    EXPECT_THROW(merge_parts(std::vector{open, open}), InputError);  // the same cells
    EXPECT_THROW(merge_parts(std::vector{open, extract_part(volume, whole, 0.5, {.normals = false})}),
                 InputError);
    const VolumeView next = part_of(volume, {3, 0, 0}, {5, 8, 8});
    EXPECT_THROW(merge_parts(std::vector{extract_part(part_of(volume, {0, 0, 0}, {4, 8, 8}), whole, 0.5),
                                         extract_part(next, whole, 0.5, {.topology = true})}),
                 InputError);
    EXPECT_TRUE(merge_parts({}).points.empty());
    EXPECT_THROW(merge_parts(std::vector{extract_part(next, whole, 0.5)}), InputError);  // a part is missing

    const Index huge{1 << 29, 1 << 20, 1 << 13};
    const VolumeView corner = part_of(volume, {0, 0, 0}, {4, 8, 8});
    EXPECT_NO_THROW(extract_part(corner, huge, 0.5, {.normals = false}));
    EXPECT_THROW(extract_part(corner, huge, 0.5, {.normals = false, .topology = true}), LimitError);

    const auto low = count_part(part, whole, 0.5);
    EXPECT_THROW(number_parts(std::vector{low}), InputError);  // a gap
    const auto all = count_part(volume, whole, 0.5);
    EXPECT_THROW(number_parts(std::vector{all, all}), InputError);
    auto moved = all;
    moved.extent.first[1] = 1;
    EXPECT_THROW(number_parts(std::vector{moved}), InputError);
    const auto first_slices = count_part(part_of(volume, {0, 0, 0}, {8, 8, 4}), whole, 0.5);
    EXPECT_THROW(number_parts(std::vector{first_slices}), InputError);  // what follows is missing
    EXPECT_THROW(number_parts(std::vector{all}, {}, {.points = 0xffffffff}), LimitError);
    const auto numbers = number_parts(std::vector{all});
    EXPECT_THROW(extract_numbered_part(part_of(volume, {0, 0, 0}, {8, 8, 4}), numbers[0], 0.5), InputError);
    EXPECT_THROW(extract_numbered_part(volume, numbers[0], 0.5, {.topology = true}), InputError);
    EXPECT_THROW(number_parts(std::vector{low, count_part(next, whole, 0.5, {.topology = true})}),
                 InputError);
}

// Between counting and extraction.
TEST(DistributedPartsTest, RefuseSamplesThatChanged) {
    const Volume volume = checkerboard(16);
    const Index dims{16, 16, 16};
    for (const bool topology : {false, true}) {
        const IsosurfaceOptions options{.topology = topology};
        std::vector<PartCounts> counts;
        for (const std::int64_t x : {0, 7})
            counts.push_back(
                count_part(part_of(volume, {x, 0, 0}, {x == 0 ? 8 : 9, 16, 16}), dims, 0.5, options));
        const std::vector<PartNumbers> numbers = number_parts(counts);
        Volume changed = checkerboard(16);
        std::uint8_t& sample = changed.samples<std::uint8_t>()[(9 * 16 + 5) * 16 + 12];
        sample = sample == 0 ? 1 : 0;
        EXPECT_NO_THROW(
            extract_numbered_part(part_of(changed, {0, 0, 0}, {8, 16, 16}), numbers[0], 0.5, options));
        EXPECT_NO_THROW(
            extract_numbered_part(part_of(volume, {7, 0, 0}, {9, 16, 16}), numbers[1], 0.5, options));
        EXPECT_THROW(
            extract_numbered_part(part_of(changed, {7, 0, 0}, {9, 16, 16}), numbers[1], 0.5, options),
            InputError);
    }
}

TEST(DistributedPartsTest, AChunkCanBeLargerThanTheVolume) {
    const Volume volume = checkerboard(8);
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    EXPECT_EQ(
        chunks_without_surface(part_of(volume, {2, 2, 2}, {4, 4, 4}), {8, 8, 8}, {kMost, 4, kMost}, 0.5),
        (std::vector<std::uint8_t>{0, 0}));
    EXPECT_EQ(chunks_without_surface(part_of(volume, {2, 2, 2}, {4, 4, 4}), {8, 8, 8}, {kMost, 4, kMost}, 2),
              (std::vector<std::uint8_t>{1, 1}));
}

TEST(DistributedPartsTest, CanBeCancelled) {
    const Volume volume = checkerboard(30);
    const IsosurfaceOptions options{.progress = [](double fraction) { return fraction < 0.3; }};
    EXPECT_THROW(extract_part(volume, {30, 30, 30}, 0.5, options), Cancelled);
    EXPECT_THROW(count_part(volume, {30, 30, 30}, 0.5, options), Cancelled);
    EXPECT_THROW(chunks_without_surface(volume, {30, 30, 30}, {8, 8, 8}, 0.5, options), Cancelled);
    const std::vector parts{extract_part(volume, {30, 30, 30}, 0.5)};
    EXPECT_THROW(merge_parts(parts, options.progress), Cancelled);
}

}  // namespace
}  // namespace marrow::test
