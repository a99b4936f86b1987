// A plugin that uses Marrow for itself.
#include "plugin.h"

#include <marrow/isosurface.h>

void fail_in_plugin() {
    marrow::Geometry geometry;
    geometry.dims = {4, 4, 4};
    const float* const no_samples = nullptr;
    marrow::extract_isosurface(marrow::VolumeView(no_samples, geometry), 0);
}
