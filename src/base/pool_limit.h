/// Limits the pool of threads of parallel_pool.h.
#pragma once

namespace marrow::internal {

/// The pool has at most this many threads, the caller included; otherwise it has as many as the machine.
/// \pre no loop ran before
void limit_pool(int threads);

}  // namespace marrow::internal
