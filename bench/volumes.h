/// The volumes that are measured.
#pragma once

#include <string>
#include <vector>

#include <marrow/volume.h>

namespace marrow::bench {

struct Case {
    std::string name;
    Volume volume;
    double isovalue;
};

/// Nested noisy ellipsoids and tubes, as a head is: int16, n^3, 1 to 2 % of the cells active at the isovalue.
Case head_phantom(std::int64_t n);
/// A gyroid: float, n^3, 10 to 20 % of the cells active.
Case gyroid(std::int64_t n);
/// A raw file, x fastest, little-endian, 1 mm. \throw InputError, IoError
Case raw_volume(const std::string& file, const std::array<std::int64_t, 3>& dims, const std::string& type,
                double isovalue);

}  // namespace marrow::bench
