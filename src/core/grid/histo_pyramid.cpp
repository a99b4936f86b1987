// Builds and searches the histogram pyramid.
#include <marrow/histo_pyramid.h>

#include <algorithm>
#include <utility>

#include <marrow/error.h>

namespace marrow {

namespace {

// The level above: each element is the sum of up to `branching` children.
template <class Count>
std::vector<std::uint64_t> sum_children(const std::vector<Count>& children, std::size_t branching) {
    std::vector<std::uint64_t> parents((children.size() + branching - 1) / branching, 0);
    std::size_t child = 0;
    for (std::uint64_t& parent : parents) {
        const std::size_t end = std::min(child + branching, children.size());
        for (; child < end; ++child) parent += children[child];
    }
    return parents;
}

// Finds the child whose range of outputs holds the key, and makes the key relative to that range.
template <class Count>
std::size_t descend(const std::vector<Count>& level, std::size_t first_child, std::uint64_t& key) {
    std::size_t child = first_child;
    for (; key >= level[child]; ++child) key -= level[child];
    return child;
}

// The outputs of the siblings to the left of `node`.
template <class Count>
std::uint64_t sum_left_siblings(const std::vector<Count>& level, std::size_t node, std::size_t branching) {
    std::uint64_t sum = 0;
    for (std::size_t sibling = node - node % branching; sibling < node; ++sibling) sum += level[sibling];
    return sum;
}

}  // namespace

HistoPyramid::HistoPyramid(std::vector<std::uint32_t> leaves, std::size_t branching)
    : branching_(branching), leaves_(std::move(leaves)) {
    if (branching < 2) throw InputError("histogram pyramid: branching must be at least 2");
    if (leaves_.empty()) return;
    upper_.push_back(sum_children(leaves_, branching_));
    while (upper_.back().size() > 1) upper_.push_back(sum_children(upper_.back(), branching_));
}

HistoPyramid::Location HistoPyramid::locate(std::uint64_t key) const {
    if (key >= total()) throw InputError("histogram pyramid: key beyond the number of outputs");
    std::size_t node = 0;  // the apex
    for (std::size_t level = upper_.size() - 1; level-- > 0;)
        node = descend(upper_[level], node * branching_, key);
    const std::size_t leaf = descend(leaves_, node * branching_, key);
    return {leaf, key};
}

std::uint64_t HistoPyramid::first_output(std::size_t leaf) const {
    if (leaf >= leaves_.size()) return total();
    std::uint64_t sum = sum_left_siblings(leaves_, leaf, branching_);
    std::size_t node = leaf / branching_;
    for (const auto& level : upper_) {
        sum += sum_left_siblings(level, node, branching_);
        node /= branching_;
    }
    return sum;
}

std::vector<std::uint32_t> HistoPyramid::release_leaves() {
    upper_.clear();
    return std::exchange(leaves_, {});
}

std::size_t HistoPyramid::bytes() const {
    std::size_t bytes = leaves_.size() * sizeof(std::uint32_t);
    for (const auto& level : upper_) bytes += level.size() * sizeof(std::uint64_t);
    return bytes;
}

}  // namespace marrow
