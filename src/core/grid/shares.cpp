// Finds where the shares of the output begin.
#include "shares.h"

#include <tbb/task_arena.h>

namespace marrow::internal {

std::size_t share_count() {
    return kSharesPerThread * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
}

std::size_t row_at(const HistoPyramid& pyramid, std::uint64_t key) {
    if (key >= pyramid.total()) return pyramid.leaves().size();
    const auto [row, remainder] = pyramid.locate(key);
    return row + (remainder > 0 ? 1 : 0);
}

}  // namespace marrow::internal
