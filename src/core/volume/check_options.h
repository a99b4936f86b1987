/// The check of options that all entry points for isosurfaces share.
#pragma once

#include <marrow/error.h>
#include <marrow/isosurface.h>

namespace marrow::internal {

/// \throw InputError `snap` is out of range, or goes with `topology`
inline void check_options(const IsosurfaceOptions& options) {
    if (!(options.snap >= 0 && options.snap < 0.5)) throw InputError("snap must be at least 0 and below 0.5");
    if (options.topology && options.snap > 0)
        throw InputError("options.topology and options.snap do not go together: leave one of them out");
}

}  // namespace marrow::internal
