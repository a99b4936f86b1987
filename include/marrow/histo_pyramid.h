/// The histogram pyramid: from an output index back to the input that makes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/export.h>

namespace marrow {

/// Counts, summed level by level up to one apex.
///
/// Leaf i says how many outputs input i makes (the histogram); each element above is the sum of up to
/// `branching` children. The apex is the size of the whole output; descending from it finds the leaf of any
/// output in O(branching * log N). Over leaves in Morton order a branching of 4 is the quadtree of Visutsak
/// 2020, Figure 10, and 8 the octree of its Figure 9. After Ziegler et al. 2006 and Dyken et al. 2008.
class MARROW_EXPORT HistoPyramid {
  public:
    /// Where an output comes from: its leaf, and which of the leaf's outputs it is.
    struct Location {
        std::size_t leaf;
        std::uint64_t remainder;
    };

    HistoPyramid() = default;
    /// Takes the leaves and builds the levels above. \throw InputError where branching < 2.
    explicit HistoPyramid(std::vector<std::uint32_t> leaves, std::size_t branching = 16);

    /// The number of outputs: the apex.
    std::uint64_t total() const { return upper_.empty() ? 0 : upper_.back().front(); }
    /// The leaf that makes output `key`. \throw InputError where key >= total().
    Location locate(std::uint64_t key) const;
    /// How many outputs the leaves before `leaf` make, for leaf <= leaves().size().
    std::uint64_t first_output(std::size_t leaf) const;

    std::span<const std::uint32_t> leaves() const { return leaves_; }
    /// The levels above the leaves, widest first; the last holds the apex alone.
    std::span<const std::vector<std::uint64_t>> levels() const { return upper_; }
    std::size_t branching() const { return branching_; }
    std::size_t bytes() const;
    /// Gives the leaves' memory back, for the next pyramid; this one is then empty.
    std::vector<std::uint32_t> release_leaves();

  private:
    std::size_t branching_ = 16;
    std::vector<std::uint32_t> leaves_;
    std::vector<std::vector<std::uint64_t>> upper_;
};

}  // namespace marrow
