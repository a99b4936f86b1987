/// Loads the head CT "Cranium" of the Debian package invesalius-examples.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <marrow/volume.h>

namespace marrow::bench {

/// The scan, 256 x 256 x 108 int16 samples in HU; nothing if the package is not installed.
inline std::optional<Volume> cranium() {
    const std::string project = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";
    if (!std::filesystem::exists(project)) return std::nullopt;
    Geometry g;
    g.dims = {256, 256, 108};
    g.spacing = {0.957031, 0.957031, 1.5};
    g.direction[1][1] = -1;  // rows run towards anterior
    Volume scan(g, SampleType::int16);
    const std::string unpack = "tar -xzOf " + project + " --wildcards '*matrix.dat'";
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(unpack.c_str(), "r"), pclose);
    if (!pipe || std::fread(scan.data(), 1, scan.bytes(), pipe.get()) != scan.bytes()) return std::nullopt;
    return scan;
}

}  // namespace marrow::bench
