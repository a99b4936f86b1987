/// The volumes of the benchmarks.
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

/// Nested noisy ellipsoids and tubes, similar to a head: int16, n^3, 1 to 2 % of the cells are active.
Case head_phantom(std::int64_t n);
/// A gyroid: float, n^3, 10 to 20 % of the cells are active.
Case gyroid(std::int64_t n);
/// A gyroid with a given period in samples: int16, n^3. Shorter periods have larger surfaces.
Case waves(std::int64_t n, std::int64_t period);
/// White noise: int16, n^3, nearly every cell is active.
Case white_noise(std::int64_t n);
/// The volume with this name: phantom-N, gyroid-N, waves-N-PERIOD, noise-N, cranium (the head CT of the
/// package invesalius-examples), vhf-head or vhf-ankle (vhf_head_ct and vhf_ankle_ct in the folder
/// MARROW_TEST_DATA). Nothing if the scan is not available. \throw InputError for an unknown name, and as
/// read_scan
std::optional<Case> named_volume(const std::string& name);
/// The number of cells with corners on both sides of the isovalue.
std::int64_t active_cells(const Case& c);
/// Reads a raw file: x fastest, little-endian, spacing 1 mm. \throw InputError for an unknown type, IoError
Case raw_volume(const std::string& file, const std::array<std::int64_t, 3>& dims, const std::string& type,
                double isovalue);

}  // namespace marrow::bench
