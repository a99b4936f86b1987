// Label maps that are extracted in parts and put together have the bytes of the surfaces of the whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include <marrow/error.h>
#include <marrow/label_parts.h>

#include "support/fields.h"

namespace marrow::test {
namespace {

using Index = std::array<std::int64_t, 3>;

// Oblique, anisotropic and, at random, mirrored.
Geometry random_geometry(Random& random) {
    std::uniform_int_distribution<std::int64_t> side(1, 34);
    Geometry g = grid(side(random) + (random() % 3 == 0 ? 50 : 0), side(random), side(random));
    g.spacing = {0.7, 0.9, 1.3};
    g.origin = {-113.7, 41.3, 207.9};
    g.direction = {{{0.8, -0.6, 0}, {0.6, 0.8, 0}, {0, 0, random() % 2 == 0 ? 1.0 : -1.0}}};
    return g;
}

// Lumps of some labels, with noise, so that many labels meet in a cell.
template <class T>
Volume random_map(Random& random) {
    const int labels = 2 + static_cast<int>(random() % 6), size = 1 + static_cast<int>(random() % 5);
    const auto seed = static_cast<std::uint32_t>(random());
    return sampled<T>(random_geometry(random), [&](auto x, auto y, auto z) {
        if (random() % 40 == 0) return static_cast<int>(random() % 4);
        std::uint32_t h = seed;
        for (const auto v : {x, y, z})
            h = (h ^ static_cast<std::uint32_t>(v) / static_cast<std::uint32_t>(size)) * 2654435761u;
        return static_cast<int>((h >> 16) % static_cast<std::uint32_t>(labels));
    });
}

std::vector<std::int64_t> random_cuts(std::int64_t n, Random& random) {
    std::vector<std::int64_t> cuts{0, n};
    for (std::int64_t i = 1; i < n; ++i)
        if (random() % 8 == 0) cuts.push_back(i);
    std::sort(cuts.begin(), cuts.end());
    return cuts;
}

// A view with samples of its own, and no more around them than a part needs.
struct OwnSamples {
    OwnSamples(const Volume& whole, const Index& first, const Index& dims, std::int64_t halo) : view(whole) {
        const Index& size = whole.geometry().dims;
        Index begin = first, end;
        for (std::size_t a = 0; a < 3; ++a) {
            begin[a] = std::max<std::int64_t>(first[a] - halo, 0);
            end[a] = std::min(first[a] + dims[a] + halo, size[a]);
            view.below[a] = first[a] - begin[a];
            view.above[a] = end[a] - first[a] - dims[a];
        }
        const std::size_t bytes = sample_size(view.type), row = static_cast<std::size_t>(size[0]) * bytes;
        for (std::int64_t z = begin[2]; z < end[2]; ++z) {
            for (std::int64_t y = begin[1]; y < end[1]; ++y) {
                const auto* from = static_cast<const std::byte*>(view.data) +
                                   static_cast<std::size_t>(z * size[1] + y) * row;
                samples.insert(samples.end(), from, from + row);
            }
        }
        view.first = first;
        view.geometry.dims = dims;
        view.pitch = {size[0], size[0] * (end[1] - begin[1])};
        view.data = samples.data() +
                    static_cast<std::size_t>(view.below[2] * view.pitch[1] + view.below[1] * size[0]) * bytes;
    }

    std::vector<std::byte> samples;
    VolumeView view;
};

std::vector<LabelPart> parts_of(const Volume& map, Random& random, const LabelOptions& options) {
    const Index& dims = map.geometry().dims;
    const auto ys = random_cuts(dims[1], random), zs = random_cuts(dims[2], random);
    std::vector<LabelPart> parts;
    for (std::size_t z = 0; z + 1 < zs.size(); ++z) {
        for (std::size_t y = 0; y + 1 < ys.size(); ++y) {
            const OwnSamples part(map, {0, ys[y], zs[z]}, {dims[0], ys[y + 1] - ys[y], zs[z + 1] - zs[z]},
                                  label_part_halo(options));
            parts.push_back(extract_label_part(part.view, dims, options));
        }
    }
    std::shuffle(parts.begin(), parts.end(), random);
    return parts;
}

template <class Values>
bool same(const Values& a, const Values& b) {
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

void expect_same(const std::vector<LabelSurface>& a, const std::vector<LabelSurface>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t l = 0; l < a.size(); ++l) {
        EXPECT_EQ(a[l].label, b[l].label);
        EXPECT_EQ(a[l].held_back_points, b[l].held_back_points) << a[l].label;
        EXPECT_TRUE(same(a[l].mesh.points, b[l].mesh.points)) << a[l].label;
        EXPECT_TRUE(same(a[l].mesh.triangles, b[l].mesh.triangles)) << a[l].label;
        EXPECT_TRUE(same(a[l].mesh.normals, b[l].mesh.normals)) << a[l].label;
    }
}

template <class T>
class LabelParts : public testing::Test {};

using SampleTypes = testing::Types<std::uint8_t, std::int16_t, std::int32_t, float>;
TYPED_TEST_SUITE(LabelParts, SampleTypes);

TYPED_TEST(LabelParts, HaveTheBytesOfTheWhole) {
    Random random(21);
    std::size_t parts = 0;
    for (int i = 0; i < 60; ++i) {
        const Volume map = random_map<TypeParam>(random);
        const LabelOptions options{.background = i % 5 == 0 ? 1 : 0,
                                   .relax = std::array{0, 1, 2, 3, 7, 40}[static_cast<std::size_t>(i) % 6],
                                   .normals = i % 4 != 0,
                                   .threads = 1 + i % 2};
        const std::vector<LabelPart> pieces = parts_of(map, random, options);
        parts += pieces.size();
        expect_same(merge_label_parts(pieces, options), extract_labels(map, options));
        if (testing::Test::HasFailure()) FAIL() << i;
    }
    EXPECT_GT(parts, 400u);
}

TEST(LabelPartsTest, CanBeCancelledWhileTheyAreMerged) {
    Random random(3);
    const Volume map =
        sampled<std::uint8_t>(grid(64, 64, 64), [&](auto, auto, auto) { return random() % 8; });
    const std::vector parts{extract_label_part(map, {64, 64, 64}, {.relax = 0})};
    for (int calls = 1; calls <= 60; ++calls) {
        int left = calls % 7 + 1;
        EXPECT_THROW(merge_label_parts(parts, {.relax = 0, .progress = [&](double) { return --left > 0; }}),
                     Cancelled);
    }
}

TEST(LabelPartsTest, RefuseWhatCannotGiveTheBytesOfTheWhole) {
    Random random(22);
    const Volume map = sampled<std::uint8_t>(grid(9, 12, 10), [&](auto, auto, auto) { return random() % 3; });
    const Index whole{9, 12, 10};
    const LabelOptions options{.relax = 1};
    const LabelPart low = extract_label_part(part_of(map, {0, 0, 0}, {9, 12, 4}), whole, options);
    const LabelPart high = extract_label_part(part_of(map, {0, 0, 4}, {9, 12, 6}), whole, options);
    expect_same(merge_label_parts(std::vector{high, low}, options), extract_labels(map, options));
    EXPECT_THROW(merge_label_parts(std::vector{low}, options), InputError);
    EXPECT_THROW(merge_label_parts(std::vector{low, high, low}, options), InputError);
    LabelPart other = high;
    other.whole[1] = 13;
    EXPECT_THROW(merge_label_parts(std::vector{low, other}, options), InputError);
    EXPECT_THROW(merge_label_parts(std::vector{low, extract_label_part(part_of(map, {0, 0, 4}, {9, 12, 6}),
                                                                       whole, {.relax = 0})},
                                   options),
                 InputError);
    EXPECT_TRUE(merge_label_parts({}, options).empty());
    const Volume half_empty =
        sampled<std::uint8_t>(grid(9, 12, 10), [](auto, auto, auto z) { return z < 5 ? 0 : 1; });
    const auto part = [&](std::int64_t first, std::int64_t slices, int relax) {
        return extract_label_part(part_of(half_empty, {0, 0, first}, {9, 12, slices}), whole,
                                  {.relax = relax});
    };
    EXPECT_NO_THROW(merge_label_parts(std::vector{part(0, 3, 1), part(3, 4, 1), part(7, 3, 1)}, options));
    EXPECT_THROW(merge_label_parts(std::vector{part(0, 3, 1), part(3, 4, 1), part(7, 3, 0)}, options),
                 InputError);

    VolumeView view = part_of(map, {0, 0, 4}, {9, 12, 6});
    view.below[2] = 2;
    EXPECT_THROW(extract_label_part(view, whole, options), InputError);
    EXPECT_NO_THROW(extract_label_part(view, whole, {.relax = 0}));
    EXPECT_THROW(extract_label_part(part_of(map, {0, 0, 0}, {5, 12, 10}), whole, options), InputError);
    EXPECT_THROW(extract_label_part(map, {9, 12, 9}, options), InputError);
    EXPECT_THROW(extract_label_part(map, whole, {.relax = -1}), InputError);
}

}  // namespace
}  // namespace marrow::test
