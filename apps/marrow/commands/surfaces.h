/// The command without a name, `marrow INPUT`: extraction, streaming or label maps, as its options say.
#pragma once

#include "extract.h"
#include "labels.h"
#include "stream.h"

namespace marrow::apps {

/// The options of all three.
struct SurfacesOptions {
    SurfaceJobOptions job;
    ExtractOptions extract;
    StreamOptions stream;
    LabelsOptions labels;
};

void add_options(Arguments& arguments, SurfacesOptions& options);

/// Runs the one that the given options belong to. \throw UsageError options that do not go together; as the
/// three
void run(const Arguments& arguments, const SurfacesOptions& options, const Console& console,
         const std::atomic<bool>& stop);

}  // namespace marrow::apps
