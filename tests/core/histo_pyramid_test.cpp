// The histogram pyramid finds the same outputs as running sums.
#include <gtest/gtest.h>

#include <random>

#include <marrow/error.h>
#include <marrow/histo_pyramid.h>

namespace marrow {
namespace {

std::vector<std::uint32_t> random_leaves(std::size_t n, std::uint32_t most, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::uint32_t> leaves(n);
    for (auto& leaf : leaves)
        leaf = random() % 3 == 0 ? static_cast<std::uint32_t>(random() % (most + 1)) : 0;
    return leaves;
}

class HistoPyramidBranching : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(All, HistoPyramidBranching, testing::Values(2, 4, 5, 8, 16, 64));

TEST_P(HistoPyramidBranching, LocatesEveryOutputOfEverySize) {
    for (std::size_t n : {1, 2, 7, 16, 17, 64, 65, 1000}) {
        const auto leaves = random_leaves(n, 6, n);
        const HistoPyramid pyramid(leaves, GetParam());
        std::uint64_t key = 0;
        for (std::size_t leaf = 0; leaf < n; ++leaf) {
            EXPECT_EQ(pyramid.first_output(leaf), key);
            for (std::uint32_t k = 0; k < leaves[leaf]; ++k, ++key) {
                const auto found = pyramid.locate(key);
                ASSERT_EQ(found.leaf, leaf);
                ASSERT_EQ(found.remainder, k);
            }
        }
        EXPECT_EQ(pyramid.total(), key);
        EXPECT_EQ(pyramid.first_output(n), key);
    }
}

TEST_P(HistoPyramidBranching, EveryElementIsTheSumOfItsChildren) {
    const HistoPyramid pyramid(random_leaves(1234, 1000, 9), GetParam());
    std::vector<std::uint64_t> below(pyramid.leaves().begin(), pyramid.leaves().end());
    for (const auto& level : pyramid.levels()) {
        ASSERT_EQ(level.size(), (below.size() + GetParam() - 1) / GetParam());
        for (std::size_t i = 0; i < level.size(); ++i) {
            std::uint64_t sum = 0;
            for (std::size_t c = i * GetParam(); c < std::min((i + 1) * GetParam(), below.size()); ++c)
                sum += below[c];
            EXPECT_EQ(level[i], sum);
        }
        below = level;
    }
    EXPECT_EQ(below.size(), 1u);
}

TEST(HistoPyramid, SumsBeyond32Bits) {
    const std::uint32_t most = 0xFFFFFFFFu;
    const HistoPyramid pyramid({most, 0, most, most}, 2);
    EXPECT_EQ(pyramid.total(), 3ull * most);
    EXPECT_EQ(pyramid.locate(2ull * most).leaf, 3u);
    EXPECT_EQ(pyramid.locate(2ull * most - 1).remainder, most - 1u);
}

TEST(HistoPyramid, RefusesKeysBeyondTheTotal) {
    const HistoPyramid empty, none(std::vector<std::uint32_t>{}), zeros(std::vector<std::uint32_t>(20, 0));
    for (const HistoPyramid* p : {&empty, &none, &zeros}) {
        EXPECT_EQ(p->total(), 0u);
        EXPECT_THROW(p->locate(0), InputError);
    }
    EXPECT_THROW(HistoPyramid({1, 2}, 1), InputError);
    EXPECT_THROW(HistoPyramid({1, 2}).locate(3), InputError);
}

}  // namespace
}  // namespace marrow
