/// Reports progress from a step of a program.
#pragma once

#include <marrow/progress.h>

namespace marrow::apps {

/// Calls `progress` if there is one. \throw Cancelled if it returns false
inline void report(const Progress& progress, double fraction) {
    if (progress && !progress(fraction)) throw Cancelled();
}

}  // namespace marrow::apps
