/// From a label map to its relaxed surface net.
#pragma once

#include <marrow/labels.h>
#include <marrow/volume.h>

#include "surface_net.h"

namespace marrow::internal {

/// \throw InputError the options are not valid
void check_label_options(const LabelOptions& options);

struct RelaxedNet {
    SurfaceNet net;
    LabelIndex background;  ///< of the labels of the net
};

/// Makes the net of a map and relaxes it. \throw as extract_labels \pre the
/// volume and the options were checked
RelaxedNet make_relaxed_net(const VolumeView& map, const LabelOptions& options, const Progress& progress);

}  // namespace marrow::internal
