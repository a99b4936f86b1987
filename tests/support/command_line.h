/// Running the command line inside a test.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commands/dispatch.h"
#include "temporary_folder.h"

namespace marrow::test {

using namespace marrow::apps;

struct Outcome {
    int code;
    std::string out;
    std::string err;
};

/// Runs `marrow ARGUMENTS...` as main would.
inline Outcome marrow_with(const std::vector<std::string>& arguments, bool stop = false) {
    std::vector<const char*> argv{"marrow"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    std::ostringstream out, err;
    const std::atomic<bool> stopped{stop};
    const int code = run_marrow(static_cast<int>(argv.size()), argv.data(), {out, err}, stopped);
    return {code, out.str(), err.str()};
}

/// Writes `value(x, y, z)` of int16 as NRRD, with samples 1 x 1 x 2 mm apart.
template <class F>
void write_nrrd(const std::filesystem::path& file, int nx, int ny, int nz, const F& value) {
    std::string text = "NRRD0005\ntype: int16\ndimension: 3\nsizes: " + std::to_string(nx) + " " +
                       std::to_string(ny) + " " + std::to_string(nz) +
                       "\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n"
                       "space origin: (10,20,30)\nendian: little\nencoding: raw\n\n";
    for (int z = 0; z < nz; ++z) {
        for (int y = 0; y < ny; ++y) {
            for (int x = 0; x < nx; ++x) {
                const auto sample = static_cast<std::int16_t>(value(x, y, z));
                text.append(reinterpret_cast<const char*>(&sample), sizeof sample);
            }
        }
    }
    write_file(file, text);
}

/// A ball of `radius` mm around sample (cx, cy, cz): 1000 at its centre, 0 at its surface, -1000 far away.
inline auto ball(double cx, double cy, double cz, double radius) {
    return [=](int x, int y, int z) {
        const double distance = std::hypot(x - cx, y - cy, 2 * (z - cz));
        return std::clamp(1000 * (1 - distance / radius), -1000.0, 1000.0);
    };
}

/// A folder with the scan of a ball in it.
class BallScan : public testing::Test {
  protected:
    void SetUp() override { write_nrrd(scan, 24, 25, 13, ball(12, 12, 6, 8)); }

    const TemporaryFolder folder;
    const std::string scan = folder / "ball.nrrd";
};

}  // namespace marrow::test
