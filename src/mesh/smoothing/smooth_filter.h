/// A low-pass filter over the edges of a mesh.
#pragma once

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>

#include "mesh/connectivity/one_rings.h"

namespace marrow::internal {

/// Three values and an unused one, as a vector register holds them.
struct alignas(16) Displacement {
    float xyz[4];
};

/// Returns by how much a low-pass filter of some degree, above 0, moves each point; see SmoothOptions. Points
/// that are not regular stay. The result has the same bits for any number of threads and any processor.
/// After Taubin, Zhang and Golub 1996. \throw Cancelled
Buffer<Displacement> low_pass(const MeshView& mesh, const OneRings& rings, int degree, double pass_band,
                              const Progress& progress);

}  // namespace marrow::internal
