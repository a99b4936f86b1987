/// Cuts the six models of Table 1 in Visutsak 2020 out of real scans.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <marrow/volume.h>

namespace marrow::paper {

struct Model {
    std::string name;    ///< as in Table 1
    std::string source;  ///< the scan it is cut from
    Volume volume;
    double isovalue;
    Vec3d view;  ///< direction from the model to the camera, LPS
};

/// Cuts the models from vhf_head_ct and vhf_ankle_ct in the folder `data`. Without vhf_head_ct, it uses
/// Cranium (invesalius-examples). Adds a note for each missing scan. \throw IoError without any head scan,
/// and as read_scan
std::vector<Model> cut_models(const std::filesystem::path& data, std::vector<std::string>& notes);

}  // namespace marrow::paper
