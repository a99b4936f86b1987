/// The six models of Table 1 in Visutsak 2020, cut out of real scans.
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
    Vec3d view;  ///< from the model to who looks at it, LPS
};

/// Cuts the models from vhf_head_ct and vhf_ankle_ct in the folder `data`, or those of the head from Cranium
/// (invesalius-examples) where it has none; `notes` receives what is missing. \throw as read_scan; IoError
/// where there is no scan at all.
std::vector<Model> cut_models(const std::filesystem::path& data, std::vector<std::string>& notes);

}  // namespace marrow::paper
