/// Encodes images as PNG.
#pragma once

#include <string>

class vtkImageData;

namespace marrow::apps {

/// The bytes of a PNG file. \throw IoError VTK cannot encode the image
std::string png_of(vtkImageData* image);

}  // namespace marrow::apps
