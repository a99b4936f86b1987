/// What the machine's memory can do: the limit that extraction is held against.
#pragma once

namespace marrow::bench {

struct Bandwidth {
    double read_bytes_per_second;
    double write_bytes_per_second;
};

/// Measured on buffers larger than the caches, with warm pages. Median of several rounds.
Bandwidth measure_bandwidth(int threads);

}  // namespace marrow::bench
