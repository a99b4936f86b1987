/// The extractors that marrow-paper compares: those of the paper's Table 1 and others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/volume.h>

namespace marrow::paper {

struct Contender {
    std::string name;
    /// Extracts the surface and sets its duration in milliseconds.
    std::function<Mesh(double& milliseconds)> run;
};

/// The first contender is the paper's marching cubes. Then follow a variant that only shares points, VTK, and
/// Marrow. The volume must outlive them. None uses more threads than the caller allows.
std::vector<Contender> make_contenders(const VolumeView& volume, double isovalue);

}  // namespace marrow::paper
