// Compares a triangle of a block with several others at once. Highway compiles this file once for each SIMD
// target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/intersections/block_pairs.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>

#include "block_pairs.h"

#include "base/parallel.h"
#include "base/radix_sort.h"
#include "mesh/geometry/load_points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace marrow::internal::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Entry = BlockPairs::Entry;

constexpr std::size_t kMostLanes = 16;
constexpr std::size_t kMostInBlock = BlockPairs::kMostInBlock;
using D = hn::CappedTag<float, kMostLanes>;
using DU = hn::RebindToUnsigned<D>;

// The triangles of a block, side by side.
class BlockTriangles {
  public:
    BlockTriangles(const MeshView& mesh, const BlockGrid& grid, const std::uint8_t* wanted,
                   const std::uint8_t* simple)
        : mesh_(mesh), loader_(mesh.points), grid_(grid), wanted_(wanted), simple_(simple) {}

    // Appends the pairs of triangles of a block, which has kMostInBlock at most. If the first block that both
    // triangles are in is a wanted one, then they are only found there.
    void find_pairs(std::span<const Entry> entries, std::vector<TrianglePair>& pairs) {
        load(entries);
        for (std::size_t i = 0; i + 1 < entries.size(); ++i) {
            for (std::size_t c = (i + 1) / hn::Lanes(D()) * hn::Lanes(D()); c < entries.size();
                 c += hn::Lanes(D())) {
                for (unsigned bits = partners(i, c, entries.size()); bits != 0; bits &= bits - 1) {
                    const std::size_t k = c + static_cast<std::size_t>(std::countr_zero(bits));
                    if (!is_found_before(i, k, entries[0].block))
                        pairs.push_back({entries[i].triangle, entries[k].triangle});
                }
            }
        }
    }

  private:
    HWY_INLINE void load(std::span<const Entry> entries) {
        const D d;
        const std::size_t count = entries.size();
        for (std::size_t first = 0; first < count; first += hn::Lanes(d)) {
            hn::Vec<D> corners[3][3];
            for (std::size_t c = 0; c < 3; ++c) {
                // The last triangle also fills the other lanes.
                loader_.load(
                    d,
                    [&](std::size_t lane) {
                        return mesh_.triangles[entries[std::min(first + lane, count - 1)].triangle][c];
                    },
                    corners[c]);
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto a = corners[0][axis], b = corners[1][axis], c = corners[2][axis];
                hn::Store(hn::Min(hn::Min(a, b), c), d, lower_[axis] + first);
                hn::Store(hn::Max(hn::Max(a, b), c), d, upper_[axis] + first);
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            const Triangle& t = mesh_.triangles[entries[i].triangle];
            for (std::size_t c = 0; c < 3; ++c) corners_[c][i] = t[c];
            all_simple_[i] = -static_cast<std::uint32_t>(simple_[t[0]] & simple_[t[1]] & simple_[t[2]]);
        }
    }

    // A bit for each triangle from c on, and after i, that has to be looked at together with i.
    HWY_INLINE unsigned partners(std::size_t i, std::size_t c, std::size_t count) const {
        const D d;
        const DU du;
        auto gap = hn::Set(d, -1);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // The sign of a float difference is exact.
            gap = hn::Max(gap, hn::Sub(hn::Load(d, lower_[axis] + c), hn::Set(d, upper_[axis][i])));
            gap = hn::Max(gap, hn::Sub(hn::Set(d, lower_[axis][i]), hn::Load(d, upper_[axis] + c)));
        }
        auto shared = hn::Ne(hn::Zero(du), hn::Zero(du));
        for (std::size_t a = 0; a < 3; ++a) {
            for (std::size_t b = 0; b < 3; ++b)
                shared = hn::Or(shared, hn::Eq(hn::Set(du, corners_[a][i]), hn::Load(du, corners_[b] + c)));
        }
        const auto is_simple =
            hn::Ne(hn::Or(hn::Set(du, all_simple_[i]), hn::Load(du, all_simple_ + c)), hn::Zero(du));
        const auto meet = hn::AndNot(hn::RebindMask(d, hn::And(shared, is_simple)), hn::Le(gap, hn::Zero(d)));
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, meet, bytes);
        unsigned bits = bytes[0] | static_cast<unsigned>(bytes[1]) << 8;
        if (c + hn::Lanes(d) > count) bits &= (1u << (count - c)) - 1;
        return c > i ? bits : bits & ~0u << (i - c + 1);
    }

    // Whether the first block that two triangles have in common is a wanted one before this one.
    HWY_INLINE bool is_found_before(std::size_t i, std::size_t k, std::uint32_t block) const {
        std::array<std::uint32_t, 3> first;
        for (std::size_t axis = 0; axis < 3; ++axis)
            first[axis] = grid_.half_block(axis, std::max(lower_[axis][i], lower_[axis][k])) / 2;
        const std::uint32_t common = grid_.index(first);
        return common != block && wanted_[common] != 0;
    }

    const MeshView mesh_;
    const PointLoader loader_;
    const BlockGrid& grid_;
    const std::uint8_t *const wanted_, *const simple_;
    HWY_ALIGN float lower_[3][kMostInBlock] = {}, upper_[3][kMostInBlock] = {};
    HWY_ALIGN std::uint32_t corners_[3][kMostInBlock] = {}, all_simple_[kMostInBlock] = {};
};

// Finds the pairs in each block of sorted entries, except for those with too many triangles.
void find_pairs(const MeshView& mesh, const BlockGrid& grid, const std::uint8_t* wanted,
                const std::uint8_t* simple, std::span<const Entry> entries,
                std::vector<TrianglePair>& pairs) {
    BlockTriangles triangles(mesh, grid, wanted, simple);
    BlockPairs::for_each_block(entries, [&](std::span<const Entry> block) {
        if (block.size() <= kMostInBlock) triangles.find_pairs(block, pairs);
    });
}

}  // namespace marrow::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace marrow::internal {

HWY_EXPORT(find_pairs);

BlockPairs::BlockPairs(MeshView mesh, const TriangleBlocks& placed, const Buffer<std::uint32_t>& numbers,
                       const Buffer<std::uint8_t>& wanted, const Buffer<std::uint8_t>& simple)
    : mesh_(mesh), grid_(placed.grid), wanted_(wanted), simple_(simple) {
    constexpr std::size_t kSection = 4096, kEntriesInPart = 16384;
    sections_.resize((numbers.size() + kSection - 1) / kSection);
    const SpanRows span_rows(grid_);
    PerThread<Buffer<Entry>> entries_of_thread;  // as their number is not known beforehand
    parallel_for(std::size_t{0}, sections_.size(), [&](std::size_t s) {
        Section& section = sections_[s];
        Buffer<Entry>& listed = entries_of_thread.local();
        const std::size_t begin = s * kSection, end = std::min(begin + kSection, numbers.size());
        std::size_t count = 0;
        const auto make_room = [&](std::size_t more) {
            if (count + more > listed.size()) listed.resize(2 * count + 8 * kSection);
        };
        // Without branches: it is unpredictable which blocks are wanted.
        const auto add = [&](std::uint32_t block, std::size_t triangle, std::uint32_t is_in) {
            listed[count] = {block, static_cast<std::uint32_t>(triangle)};
            count += wanted[block] & is_in;
        };
        for (std::size_t i = begin; i < end; ++i) {
            make_room(8);
            const std::uint32_t span = placed.spans[numbers[i]];
            if (span == TriangleBlocks::kLarge)
                BlockReach(mesh, grid_, mesh.triangles[i]).for_each_block([&](const auto& block) {
                    make_room(1);
                    add(grid_.index(block), i, 1);
                });
            else
                span_rows.for_each_near(
                    span, [&](std::uint32_t block, std::uint32_t is_in) { add(block, i, is_in); });
        }
        section.entries.assign(listed.begin(), listed.begin() + static_cast<std::ptrdiff_t>(count));
        for (const Entry& entry : section.entries) {
            section.first = std::min(section.first, entry.block);
            section.last = std::max(section.last, entry.block);
        }
    });
    std::size_t entries = 0;
    double reaches = 0;  // of the sections, as parts of the grid
    for (const Section& section : sections_) {
        entries += section.entries.size();
        if (!section.entries.empty()) reaches += section.last - section.first;
    }
    reaches /= static_cast<double>(grid_.size());
    parts_ = 1 + entries / kEntriesInPart;
    // Each part goes over all sections that reach it. If triangles are in no spatial order, that is most.
    constexpr double kMostReached = 4;  // parts by each section, on average
    if (reaches * static_cast<double>(parts_) > kMostReached * static_cast<double>(sections_.size()))
        parts_ = std::min(parts_, 4 * static_cast<std::size_t>(thread_count()));
}

void BlockPairs::pairs_in(std::size_t part, std::vector<TrianglePair>& pairs,
                          std::vector<std::uint32_t>& crowded) const {
    const auto begin = static_cast<std::uint32_t>(grid_.size() * part / parts_),
               end = static_cast<std::uint32_t>(grid_.size() * (part + 1) / parts_);
    std::vector<Entry> entries;
    std::size_t count = 0;
    for (const Section& section : sections_) {
        if (section.first >= end || section.last < begin) continue;
        if (count + section.entries.size() > entries.size())
            entries.resize(2 * count + section.entries.size());
        // Without branches, like above.
        Entry* const to = entries.data();
        for (const Entry& entry : section.entries) {
            to[count] = entry;
            count += entry.block - begin < end - begin ? 1 : 0;
        }
    }
    entries.resize(count);
    radix_sort(entries, std::bit_width(end - begin), [&](const Entry& entry) { return entry.block - begin; });
    HWY_DYNAMIC_DISPATCH(find_pairs)(mesh_, grid_, wanted_.data(), simple_.data(), entries, pairs);
    for_each_block(entries, [&](std::span<const Entry> block) {
        if (block.size() <= kMostInBlock) return;
        for (const Entry& entry : block) crowded.push_back(entry.triangle);
    });
}

}  // namespace marrow::internal
#endif
