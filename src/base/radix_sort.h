/// A stable sort by whole numbers of few bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace marrow::internal {

/// Sorts a vector by the `bits` lower bits of key(element). Elements with the same key keep their order.
template <class List, class Key>
void radix_sort(List& elements, int bits, const Key& key) {
    constexpr int kMostInDigit = 11;
    const int passes = (bits + kMostInDigit - 1) / kMostInDigit;
    if (passes == 0) return;
    const int digit = (bits + passes - 1) / passes;
    const std::uint32_t mask = (std::uint32_t{1} << digit) - 1;
    List sorted(elements.size());
    std::vector<std::size_t> start(mask + std::size_t{2});
    for (int pass = 0; pass < passes; ++pass) {
        const auto digit_of = [&](const auto& element) { return (key(element) >> pass * digit) & mask; };
        start.assign(start.size(), 0);
        for (const auto& element : elements) ++start[digit_of(element) + 1];
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (const auto& element : elements) sorted[start[digit_of(element)]++] = element;
        elements.swap(sorted);
    }
}

}  // namespace marrow::internal
