/// What Table 1 compares, and what it leaves out: the ways from a volume to a surface.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::paper {

struct Arm {
    std::string name;
    /// Extracts the surface and says how long that took, in milliseconds.
    std::function<Mesh(double& milliseconds)> run;
};

/// The paper's "marching cubes" comes first, then what sharing points alone brings, another implementation, and
/// Marrow. The volume must outlive them; none uses more threads than the caller allows.
std::vector<Arm> make_arms(const VolumeView& volume, double isovalue);

}  // namespace marrow::paper
