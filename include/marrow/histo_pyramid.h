/// The histogram pyramid, which finds the input that makes a given output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <marrow/export.h>

namespace marrow {

/// A tree of counts, summed level by level up to one number, the apex.
///
/// Leaf i is the number of outputs that input i makes. Each element above is the sum of up to `branching`
/// children. The apex is the size of the whole output. A descent from the apex finds the leaf of any output
/// in O(branching * log N). Over leaves in Morton order, a branching of 4 is the quadtree of Visutsak 2020,
/// Figure 10, and 8 the octree of its Figure 9. After Ziegler et al. 2006 and Dyken et al. 2008.
class MARROW_EXPORT HistoPyramid {
  public:
    /// The origin of an output: its leaf, and its index among the outputs of that leaf.
    struct Location {
        std::size_t leaf;
        std::uint64_t remainder;
    };

    HistoPyramid() = default;
    /// Takes the leaves and builds the levels above them. \throw InputError branching < 2
    explicit HistoPyramid(std::vector<std::uint32_t> leaves, std::size_t branching = 16);

    /// The number of outputs: the apex.
    std::uint64_t total() const { return upper_.empty() ? 0 : upper_.back().front(); }
    /// The origin of output `key`. \throw InputError key >= total()
    Location locate(std::uint64_t key) const;
    /// The number of outputs of the leaves before `leaf`. \pre leaf <= leaves().size()
    std::uint64_t first_output(std::size_t leaf) const;

    std::span<const std::uint32_t> leaves() const { return leaves_; }
    /// The levels above the leaves, from the widest to the apex.
    std::span<const std::vector<std::uint64_t>> levels() const { return upper_; }
    std::size_t branching() const { return branching_; }
    std::size_t bytes() const;
    /// Returns the leaves, so that the next pyramid can use their memory. This pyramid is then empty.
    std::vector<std::uint32_t> release_leaves();

  private:
    std::size_t branching_ = 16;
    std::vector<std::uint32_t> leaves_;
    std::vector<std::vector<std::uint64_t>> upper_;
};

}  // namespace marrow
