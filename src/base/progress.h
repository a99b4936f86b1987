/// Reporting progress from inside the library.
#pragma once

#include <cmath>

#include <marrow/progress.h>

namespace marrow::internal {

/// Calls `progress` if there is one. \throw Cancelled if it returns false
inline void report_progress(const Progress& progress, double fraction) {
    if (progress && !progress(fraction)) throw Cancelled();
}

/// The progress of one step of a longer task: the step reports fractions from 0 to 1, and `progress` receives
/// them scaled to the range from `begin` to `end`. The result refers to `progress`, which must outlive it.
inline Progress sub_progress(const Progress& progress, double begin, double end) {
    if (!progress) return {};
    return [&progress, begin, end](double fraction) { return progress(std::lerp(begin, end, fraction)); };
}

}  // namespace marrow::internal
