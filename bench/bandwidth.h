/// Measures the bandwidth of the memory, which limits extraction.
#pragma once

namespace marrow::bench {

struct Bandwidth {
    double read_bytes_per_second;
    double write_bytes_per_second;
};

/// The median of several rounds on buffers larger than the caches, with warm pages.
Bandwidth measure_bandwidth(int threads);

}  // namespace marrow::bench
