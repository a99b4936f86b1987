/// Reports progress from a step of a program.
#pragma once

#include <cmath>

#include <marrow/progress.h>

namespace marrow::apps {

/// Calls `progress` if there is one. \throw Cancelled if it returns false
inline void report(const Progress& progress, double fraction) {
    if (progress && !progress(fraction)) throw Cancelled();
}

/// Progress from `begin` to `end` of `whole`, which must live longer.
inline Progress share_of(const Progress& whole, double begin, double end) {
    return [&whole, begin, end](double done) { return !whole || whole(std::lerp(begin, end, done)); };
}

}  // namespace marrow::apps
