/// The command `marrow devices`: lists the devices of Vulkan.
#pragma once

#include "options.h"
#include "shared/console.h"

namespace marrow::apps {

struct DevicesCommandOptions {
    Reporting reporting;
};

void add_options(Arguments& arguments, DevicesCommandOptions& options);

/// Prints a line for each device, or one line that says why there is none.
void run(const DevicesCommandOptions& options, const Console& console);

}  // namespace marrow::apps
