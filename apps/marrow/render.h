/// Draws surfaces to a picture.
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/progress.h>

namespace marrow::apps {

/// A surface in a picture.
struct RenderedSurface {
    const Mesh* mesh;                          ///< LPS millimetres, with normals
    std::array<double, 3> colour;              ///< red, green, blue from 0 to 1
    bool translucent;                          ///< like glass, so that the surfaces inside are visible
    std::span<const Rgb8> point_colours = {};  ///< one per point or none; instead of `colour`
};

/// The direction of the camera, in degrees: turned from the front (-y) towards the left (x), and raised.
struct CameraAngles {
    double turn = 33, rise = 8;
};

/// Draws the surfaces, z up, to a PNG file that appears complete or not at all. The default camera looks from
/// the patient's front left. \throw IoError no display, or the file cannot be written; Cancelled
void render(const std::vector<RenderedSurface>& surfaces, const std::filesystem::path& file,
            const Progress& progress, const CameraAngles& camera = {});

}  // namespace marrow::apps
