/// The extractors that marrow-bench compares.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <marrow/volume.h>

namespace marrow::bench {

struct Result {
    double milliseconds = 0;
    std::int64_t points = 0;
    std::int64_t triangles = 0;
    std::int64_t output_bytes = 0;
    std::int64_t scratch_bytes = -1;  ///< -1: unknown
};

struct Contender {
    std::string name;
    /// Times one extraction. Frees the output before it returns, which is not timed.
    std::function<Result()> run;
};

/// marrow, marrow-next, marrow-no-normals, flying-edges, flying-edges-no-normals, vtk-marching-cubes and
/// classic. All read the same buffer, and the volume must outlive them.
std::vector<Contender> make_contenders(const VolumeView& volume, double isovalue, int threads);

}  // namespace marrow::bench
