/// The option that chooses where surfaces are extracted.
#pragma once

#include <string>

#include "arguments.h"

namespace marrow::apps {

/// Adds --device, whose value gpu::choose_device() takes. What `device` holds is the default, which the help
/// names.
void add_device_option(Arguments& arguments, std::string& device);

}  // namespace marrow::apps
