/// The parameters of all kernels, in the layout of shaders/parameters.glsl, which explains them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <marrow/vector.h>

namespace marrow::gpu::internal {

/// The address of memory on the device.
using Address = std::uint64_t;

/// A histogram pyramid on the device.
struct PyramidParameters {
    static constexpr std::size_t kMostLevels = 9;  // 16^8 leaves are more than 32 bits can count

    Address leaves = 0, nodes = 0;
    std::array<std::uint32_t, kMostLevels> size{}, begin{};
    std::uint32_t top = 0;
    std::uint32_t unused = 0;
};

struct Parameters {
    Address slabs = 0, ranges = 0, list = 0, bits = 0, row_bases = 0, status = 0;
    Address points = 0, normals = 0, triangles = 0;
    std::array<PyramidParameters, 2> pyramids;
    std::array<std::int32_t, 3> dims{}, stored{}, lead{};
    std::array<std::int32_t, 2> grid_rows{};
    std::int32_t first_x = 0;
    std::uint32_t row_words = 0, leaf_words = 0, slab_slices = 0;
    std::int32_t threshold = 0, previous_threshold = 0;
    std::uint32_t has_previous = 0;
    std::array<std::uint32_t, 2> room{};
    float half_isovalue = 0;
    std::array<Vec3f, 3> matrix{}, normal_matrix{}, axis{};
    std::array<std::array<std::uint32_t, 2>, 256> cases{};
};
static_assert(sizeof(PyramidParameters) == 96 && offsetof(Parameters, dims) == 264 &&
              offsetof(Parameters, threshold) == 324 && offsetof(Parameters, cases) == 456);

/// The words of `status`.
struct Status {
    std::uint64_t not_finite = 0;
    std::uint32_t unsafe = 0, listed = 0, mixed = 0;
};

/// What is pushed for each dispatch.
struct Push {
    Address parameters;
    std::uint32_t which, level;
};

}  // namespace marrow::gpu::internal
