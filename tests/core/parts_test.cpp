// Parts of volumes have the bits of the whole, and gaps between rows and slices change nothing.
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>

#include <marrow/histogram.h>
#include <marrow/isosurface.h>
#include <marrow/isovalue_sweep.h>
#include <marrow/labels.h>
#include <marrow/volume_filters.h>

#include "support/fields.h"
#include "support/mesh_checks.h"

namespace marrow::test {
namespace {

using Index = std::array<std::int64_t, 3>;

// Oblique, anisotropic and, at random, mirrored.
Geometry random_geometry(Random& random) {
    std::uniform_int_distribution<std::int64_t> side(2, 12);
    Geometry g = grid(side(random) * (random() % 4 == 0 ? 8 : 1), side(random), side(random));
    g.spacing = {0.7, 0.9, 1.3};
    g.origin = {-113.7, 41.3, 207.9};
    g.direction = {{{0.8, -0.6, 0}, {0.6, 0.8, 0}, {0, 0, random() % 2 == 0 ? 1.0 : -1.0}}};
    return g;
}

// Noise of few values, so that some equal the isovalue 2.
template <class T>
Volume noise(const Geometry& g, Random& random) {
    return sampled<T>(g, [&](auto, auto, auto) { return random() % 5; });
}

// The same samples with gaps around rows and slices, which hold samples that must not be read.
template <class T>
struct Padded {
    Padded(const Volume& volume, Random& random) {
        const auto [nx, ny, nz] = volume.geometry().dims;
        const auto row = nx + static_cast<std::int64_t>(random() % 5),
                   slice = row * ny + static_cast<std::int64_t>(random() % 9);
        samples.assign(static_cast<std::size_t>(slice * nz + 16), T(100));
        for (std::int64_t z = 0; z < nz; ++z) {
            for (std::int64_t y = 0; y < ny; ++y)
                std::copy_n(volume.samples<T>() + (z * ny + y) * nx, nx,
                            samples.begin() + z * slice + y * row);
        }
        view = VolumeView(samples.data(), volume.geometry());
        view.pitch = {row, slice};
    }

    std::vector<T> samples;
    VolumeView view;
};

// The key of a point: the grid edge that it lies on, in the whole volume.
using Edge = std::pair<Index, std::size_t>;

// The crossed edges of a view in the order of its points.
template <class T>
std::vector<Edge> crossed_edges(const VolumeView& v, double isovalue) {
    const auto& dims = v.geometry.dims;
    const auto inside = [&](const Index& i) {
        return static_cast<double>(static_cast<const T*>(
                   v.data)[i[2] * v.slice_pitch() + i[1] * v.row_pitch() + i[0]]) >= isovalue;
    };
    std::vector<Edge> edges;
    for (std::int64_t z = 0; z < dims[2]; ++z) {
        for (std::int64_t y = 0; y < dims[1]; ++y) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::int64_t x = 0; x < dims[0]; ++x) {
                    Index end{x, y, z};
                    if (++end[axis] == dims[axis] || inside({x, y, z}) == inside(end)) continue;
                    edges.push_back({{x + v.first[0], y + v.first[1], z + v.first[2]}, axis});
                }
            }
        }
    }
    return edges;
}

template <class T>
class Parts : public testing::Test {};

using SampleTypes =
    testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::int32_t, float, double>;
TYPED_TEST_SUITE(Parts, SampleTypes);

TYPED_TEST(Parts, HaveTheBitsOfTheWhole) {
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const Volume volume = noise<TypeParam>(random_geometry(random), random);
        const Mesh whole = extract_isosurface(volume, 2);
        const std::vector<Edge> edges = crossed_edges<TypeParam>(volume, 2);
        ASSERT_EQ(edges.size(), whole.points.size());
        std::map<Edge, std::size_t> point_on;
        for (std::size_t p = 0; p < edges.size(); ++p) point_on[edges[p]] = p;

        Index begin, dims;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto n = static_cast<std::uint64_t>(volume.geometry().dims[a]);
            begin[a] = static_cast<std::int64_t>(random() % n);
            dims[a] = 1 + static_cast<std::int64_t>(random() % (n - static_cast<std::uint64_t>(begin[a])));
        }
        VolumeView part = part_of(volume, begin, dims);
        for (std::size_t a = 0; a < 3; ++a) {  // one sample more on each side is enough
            part.below[a] =
                std::min<std::int64_t>(part.below[a], 1 + static_cast<std::int64_t>(random() % 2));
            part.above[a] =
                std::min<std::int64_t>(part.above[a], 1 + static_cast<std::int64_t>(random() % 2));
        }
        const Mesh mesh = extract_isosurface(part, 2);
        if (dims[0] < 2 || dims[1] < 2 || dims[2] < 2) {
            ASSERT_TRUE(mesh.points.empty());
            continue;
        }
        const std::vector<Edge> part_edges = crossed_edges<TypeParam>(part, 2);
        ASSERT_EQ(part_edges.size(), mesh.points.size());
        for (std::size_t p = 0; p < mesh.points.size(); ++p) {
            const std::size_t q = point_on.at(part_edges[p]);
            ASSERT_EQ(std::memcmp(&mesh.points[p], &whole.points[q], sizeof(Vec3f)), 0) << i;
            ASSERT_EQ(std::memcmp(&mesh.normals[p], &whole.normals[q], sizeof(Vec3f)), 0) << i;
        }
        ASSERT_EQ(triangle_positions(mesh), triangle_positions(extract_isosurface_classic(part, 2)));
        // A closed part is closed at its own border, and has no samples there.
        const Mesh closed = extract_isosurface(part, 2, {.closed = true});
        ASSERT_EQ(manifold_fault(closed), "");
        ASSERT_EQ(triangle_positions(closed), triangle_positions(extract_isosurface_classic(part, 2, true)));
    }
}

// With exact topology, also the points inside cells.
TYPED_TEST(Parts, HaveTheBitsOfTheWholeWithExactTopology) {
    Random random(3);
    std::size_t inner = 0;
    for (int i = 0; i < 200; ++i) {
        const Volume volume = noise<TypeParam>(random_geometry(random), random);
        const Mesh whole = extract_isosurface(volume, 2, {.topology = true});
        inner += whole.points.size() - extract_isosurface(volume, 2).points.size();
        std::set<std::pair<PointBits, PointBits>> points;
        for (std::size_t p = 0; p < whole.points.size(); ++p)
            points.insert({bits_of(whole.points[p]), bits_of(whole.normals[p])});
        Index begin, dims;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t n = volume.geometry().dims[a];
            begin[a] = n / 3;
            dims[a] = n - 2 * begin[a];
        }
        const Mesh part = extract_isosurface(part_of(volume, begin, dims), 2, {.topology = true});
        for (std::size_t p = 0; p < part.points.size(); ++p)
            ASSERT_TRUE(points.contains({bits_of(part.points[p]), bits_of(part.normals[p])})) << i;
    }
    EXPECT_GT(inner, 100u);
}

TYPED_TEST(Parts, GapsChangeNothing) {
    Random random(2);
    for (int i = 0; i < 100; ++i) {
        const Volume volume = noise<TypeParam>(random_geometry(random), random);
        const Padded<TypeParam> padded(volume, random);
        const VolumeView view = padded.view;
        for (const bool closed : {false, true}) {
            for (const double snap : {0.0, 0.3}) {
                const IsosurfaceOptions options{.closed = closed, .snap = snap, .threads = 1 + i % 2};
                ASSERT_EQ(mesh_hash(extract_isosurface(view, 2, options)),
                          mesh_hash(extract_isosurface(volume, 2, options)));
            }
            const IsosurfaceOptions exact{.closed = closed, .topology = true};
            ASSERT_EQ(mesh_hash(extract_isosurface(view, 2, exact)),
                      mesh_hash(extract_isosurface(volume, 2, exact)));
        }
        IsosurfaceExtractor dense(volume), with_gaps(view);
        for (const double isovalue : {1.0, 3.5, 2.0})
            ASSERT_EQ(mesh_hash(with_gaps.extract(isovalue)), mesh_hash(dense.extract(isovalue)));
        ASSERT_EQ(mesh_hash(with_gaps.extract(2, 1)), mesh_hash(dense.extract(2, 1)));

        const std::vector<double> isovalues{1, 2.5, 4};
        const auto a = sweep_isovalues(view, isovalues), b = sweep_isovalues(volume, isovalues);
        for (std::size_t k = 0; k < isovalues.size(); ++k) {
            ASSERT_EQ(a[k].volume, b[k].volume);
            ASSERT_EQ(a[k].area, b[k].area);
            ASSERT_EQ(a[k].components, b[k].components);
        }
        ASSERT_EQ(histogram(view).counts, histogram(volume).counts);
        ASSERT_EQ(count_labels(view), count_labels(volume));
        const auto labels = extract_labels(view), dense_labels = extract_labels(volume);
        ASSERT_EQ(labels.size(), dense_labels.size());
        for (std::size_t l = 0; l < labels.size(); ++l)
            ASSERT_EQ(mesh_hash(labels[l].mesh), mesh_hash(dense_labels[l].mesh));
        const auto same = [](const Volume& p, const Volume& q) {
            return p.bytes() == q.bytes() && std::memcmp(p.data(), q.data(), p.bytes()) == 0;
        };
        ASSERT_TRUE(same(median_filter(view, 1), median_filter(volume, 1)));
        ASSERT_TRUE(same(gaussian_filter(view, 1), gaussian_filter(volume, 1)));
        ASSERT_TRUE(same(crop(view, {0, 1, 1}, {1, 1, 1}), crop(volume, {0, 1, 1}, {1, 1, 1})));
    }
}

// Filters and previews make volumes of their own, which lie where the part lies.
TEST(PartsInSpace, ResultsLieWhereThePartLies) {
    Random random(3);
    Geometry g = random_geometry(random);
    g.dims = {20, 18, 16};
    const Volume volume = noise<std::int16_t>(g, random);
    const VolumeView part = part_of(volume, {3, 4, 5}, {9, 8, 7});
    const Volume cut = crop(volume, {3, 4, 5}, {11, 11, 11});
    for (const Volume& filtered : {median_filter(part, 1), gaussian_filter(part, 1)})
        EXPECT_EQ(filtered.geometry().origin, cut.geometry().origin);
    EXPECT_EQ(crop(part, {0, 0, 0}, {8, 7, 6}).geometry().origin, cut.geometry().origin);
    EXPECT_EQ(mesh_hash(IsosurfaceExtractor(part).extract(2, 1)),
              mesh_hash(IsosurfaceExtractor(cut).extract(2, 1)));
    const auto labels = extract_labels(part), labels_of_cut = extract_labels(cut);
    ASSERT_EQ(labels.size(), labels_of_cut.size());
    for (std::size_t l = 0; l < labels.size(); ++l) {
        ASSERT_EQ(labels[l].mesh.triangles, labels_of_cut[l].mesh.triangles);
        for (std::size_t p = 0; p < labels[l].mesh.points.size(); ++p) {
            for (std::size_t r = 0; r < 3; ++r)
                ASSERT_NEAR(labels[l].mesh.points[p][r], labels_of_cut[l].mesh.points[p][r], 1e-4);
        }
    }
}

}  // namespace
}  // namespace marrow::test
