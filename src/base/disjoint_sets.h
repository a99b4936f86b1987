/// Disjoint sets of the numbers 0 to n - 1 in an array of parents (union-find with path halving).
///
/// The caller owns the array, which begins as parents[i] = i. The lowest number of a set represents it.
#pragma once

#include <algorithm>
#include <cstddef>

namespace marrow::internal {

/// The number that represents the set of i.
template <class Parents>
auto representative(Parents& parents, std::size_t i) {
    while (parents[i] != i) {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    return parents[i];
}

/// Unites the sets of a and b; returns whether they were separate.
template <class Parents>
bool unite(Parents& parents, std::size_t a, std::size_t b) {
    const auto root_a = representative(parents, a), root_b = representative(parents, b);
    if (root_a == root_b) return false;
    parents[std::max(root_a, root_b)] = std::min(root_a, root_b);
    return true;
}

}  // namespace marrow::internal
