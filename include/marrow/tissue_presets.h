// Isovalues in Hounsfield units for tissues in CT.
#pragma once

#include <array>
#include <string_view>

#include <marrow/scan_io.h>

namespace marrow {

/// A surface around CT samples of at least `lowest` HU.
struct Preset {
    std::string_view name;
    double lowest;
    std::array<double, 3> colour;  ///< in pictures; red, green, blue from 0 to 1

    /// Between `lowest` and the integer below, where no sample of a CT lies: the same samples are inside, and no
    /// triangle shrinks to a point of the grid.
    constexpr double isovalue() const { return lowest - 0.5; }
};

// A surface parts what is denser from what is less dense, so a preset is a lower limit: the surface of
// `fat` encloses muscle and bone too. Air is -1000 HU and water 0 HU by definition. Where the limits come
// from:
//
// bone    226: the lower limit that InVesalius proposes for bone, as in the project of the example skull.
// muscle   10: the lower end of muscle in common tables of Hounsfield units (10 to 40).
// soft   -100: the density of typical fat: lean tissue and skin, with the denser half of the fat.
// fat    -150: the lower end of the range by which fat is often measured in CT (-150 to -50).
// skin   -300: between fat and air. Half-way between tissue and air would be about -500; the higher value leaves out
//              more of hair, cloth and head rest, and still encloses all fat.
inline constexpr std::array<Preset, 5> kPresets{{
    {"bone", 226, {0.95, 0.91, 0.83}},
    {"skin", -300, {0.93, 0.72, 0.60}},
    {"soft", -100, {0.86, 0.60, 0.52}},
    {"fat", -150, {0.94, 0.83, 0.58}},
    {"muscle", 10, {0.72, 0.32, 0.28}},
}};

inline constexpr double kAir = -500;  ///< HU; below this there is only air and lung

/// Whether samples are Hounsfield units: those of CT, or of a format that does not state the modality and holds air.
/// `lowest` is the lowest sample.
constexpr bool presets_apply(std::string_view modality, ScanFormat format, double lowest) {
    if (!modality.empty()) return modality == "CT";
    return format != ScanFormat::dicom && lowest <= kAir;
}

/// The preset of that name, or null.
constexpr const Preset* find_preset(std::string_view name) {
    for (const Preset& preset : kPresets) {
        if (preset.name == name) return &preset;
    }
    return nullptr;
}

}  // namespace marrow
