/// Isovalues in Hounsfield units (HU) for tissues in CT.
#pragma once

#include <array>
#include <string_view>

#include <marrow/scan_io.h>

namespace marrow {

/// A surface that encloses the CT samples of at least `lowest` HU.
struct Preset {
    std::string_view name;
    double lowest;
    std::array<double, 3> colour;  ///< for pictures: red, green, blue from 0 to 1

    /// Half a unit below `lowest`. Samples of CT are integers, so the same samples are inside, and none
    /// lies on the surface.
    constexpr double isovalue() const { return lowest - 0.5; }
};

// Each preset is a lower limit, because a surface encloses everything that is denser: the surface of `fat`
// encloses muscle and bone too. By definition, air is -1000 HU and water 0 HU. The limits come from these
// sources:
//
// bone    226: the lower limit for bone that InVesalius proposes, as in the project of its example skull.
// muscle   10: the lower end of muscle in common tables of Hounsfield units (10 to 40).
// soft   -100: the density of typical fat, so it encloses lean tissue, skin, and the denser half of the fat.
// fat    -150: the lower end of the range by which fat is often measured in CT (-150 to -50).
// skin   -300: between fat and air. The middle between tissue and air would be about -500. The higher value
//              leaves out more of hair, cloth and head rest, and still encloses all fat.
inline constexpr std::array<Preset, 5> kPresets{{
    {"bone", 226, {0.95, 0.91, 0.83}},
    {"skin", -300, {0.93, 0.72, 0.60}},
    {"soft", -100, {0.86, 0.60, 0.52}},
    {"fat", -150, {0.94, 0.83, 0.58}},
    {"muscle", 10, {0.72, 0.32, 0.28}},
}};

inline constexpr double kAir = -500;  ///< HU; only air and lung are below it

/// Whether samples are Hounsfield units: if the modality is CT, or if the format does not state the modality
/// and some samples are air. `lowest` is the lowest sample.
constexpr bool presets_apply(std::string_view modality, ScanFormat format, double lowest) {
    if (!modality.empty()) return modality == "CT";
    return format != ScanFormat::dicom && lowest <= kAir;
}

/// The preset with this name, or null.
constexpr const Preset* find_preset(std::string_view name) {
    for (const Preset& preset : kPresets) {
        if (preset.name == name) return &preset;
    }
    return nullptr;
}

}  // namespace marrow
