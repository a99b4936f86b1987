// The command `marrow sweep`: how the surface depends on the isovalue.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <marrow/isovalue_sweep.h>

namespace marrow {

struct SweepSettings {
    std::optional<double> from, to;  ///< none: the least and largest sample
    int samples = 100;
    std::filesystem::path plot;  ///< .svg; empty: none
};

/// A sweep as comma-separated values, one line a sample, with the number of the plateau it lies on.
std::string sweep_csv(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

/// A sweep as one JSON object.
std::string sweep_json(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

/// A drawing of a sweep in SVG: volume, area, components and triangles over the isovalue, plateaus shaded.
std::string sweep_svg(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus);

}  // namespace marrow
