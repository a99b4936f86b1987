/// The compute shaders, as SPIR-V.
#pragma once

#include <cstdint>
#include <span>

namespace marrow::gpu::internal {

/// The kernels, in the order in which an extraction runs them.
enum class Kernel { ranges, classify, count, reduce, descend, points, triangles };
inline constexpr int kKernels = 7;

/// The module of a kernel, whose entry point is main.
std::span<const std::uint32_t> spirv(Kernel kernel);

}  // namespace marrow::gpu::internal
