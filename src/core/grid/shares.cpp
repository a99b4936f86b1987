// Finds where the shares of the output begin.
#include "shares.h"

#include "base/parallel.h"

namespace marrow::internal {

std::size_t share_count() {
    return kSharesPerThread * static_cast<std::size_t>(thread_count());
}

std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key) {
    if (key >= pyramid.total()) return pyramid.leaves().size();
    const auto [row, remainder] = pyramid.locate(key);
    return row + (remainder > 0 ? 1 : 0);
}

}  // namespace marrow::internal
