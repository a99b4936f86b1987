/// The compute shaders, as SPIR-V.
#pragma once

#include <cstdint>
#include <span>

namespace marrow::gpu::internal {

/// The kernels of shaders/. Devices that control how floats are rounded run
/// points_controlled instead of points.
enum class Kernel { ranges, select, classify, count, reduce, descend, points, points_controlled, triangles };

/// The module of a kernel, whose entry point is main.
std::span<const std::uint32_t> spirv(Kernel kernel);

}  // namespace marrow::gpu::internal
