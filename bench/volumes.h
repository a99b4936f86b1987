/// The volumes that are measured.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
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
/// A gyroid again, int16, whose surface is the larger the shorter its period, in samples.
Case waves(std::int64_t n, std::int64_t period);
/// phantom-N, gyroid-N, waves-N-PERIOD, cranium (the head CT of the package invesalius-examples) or vhf-head (vhf_head_ct in the folder
/// MARROW_TEST_DATA) by its name; none where that scan is not there. \throw InputError an unknown name; as read_scan
std::optional<Case> named_volume(const std::string& name);
/// How many cells have corners on both sides of the isovalue.
std::int64_t active_cells(const Case& c);
/// A raw file, x fastest, little-endian, 1 mm. \throw InputError, IoError
Case raw_volume(const std::string& file, const std::array<std::int64_t, 3>& dims, const std::string& type,
                double isovalue);

}  // namespace marrow::bench
