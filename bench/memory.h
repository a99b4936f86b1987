/// Chooses what memory the benchmarks' allocations get.
#pragma once

namespace marrow::bench {

/// Whether every large allocation maps new pages, as in the first call of a program, or reuses the pages of
/// the heap. Affects all later allocations.
enum class Memory { fresh, retained };
void set_memory(Memory memory);

}  // namespace marrow::bench
