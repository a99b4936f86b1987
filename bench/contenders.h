/// The extractors that are compared, behind one call.
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
    std::int64_t scratch_bytes = -1;  ///< -1: not known
};

struct Arm {
    std::string name;
    /// One timed extraction; its output is freed before it returns, outside the time.
    std::function<Result()> run;
};

/// marrow, marrow-next, marrow-no-normals, flying-edges, flying-edges-no-normals, vtk-marching-cubes,
/// classic. The volume must outlive them; all read the same buffer.
std::vector<Arm> make_arms(const VolumeView& volume, double isovalue, int threads);

/// Whether large allocations come from freshly mapped pages every time, as in a program's first call, or from
/// a heap that keeps its pages. The same for every arm; affects allocations from now on.
enum class Memory { fresh, retained };
void set_memory(Memory memory);

}  // namespace marrow::bench
