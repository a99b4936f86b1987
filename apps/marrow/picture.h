// A rendered view of surfaces, for a first look and for front pages.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/progress.h>

namespace marrow {

/// A surface in a picture.
struct PictureSurface {
    const Mesh* mesh;              ///< LPS millimetres, with normals
    std::array<double, 3> colour;  ///< red, green, blue from 0 to 1
    bool translucent;              ///< like glass, so that the surfaces inside show
};

/// Where a picture is taken from, in degrees: turned from the front (-y) towards the left (x), and risen.
struct PictureView {
    double turn = 33, rise = 8;
};

/// Pictures are drawn by OpenGL through an X display. \throw IoError, with advice, where there is none.
void require_display();

/// Draws the surfaces, z up, to a PNG file that appears whole or not at all. Without a view, from the patient's front
/// left.
/// \throw IoError no display, or the file cannot be written; Cancelled
void write_picture(const std::vector<PictureSurface>& surfaces, const std::filesystem::path& file,
                   const Progress& progress, const PictureView& view = {});

}  // namespace marrow
