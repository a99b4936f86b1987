/// How long-running tasks report their progress, and how they are cancelled.
#pragma once

#include <functional>

#include <marrow/error.h>

namespace marrow {

/// Called from time to time with the fraction of the work that is done, from 0 to 1. The fraction never
/// decreases. If it returns false, the work stops and throws Cancelled. It may be called from worker threads,
/// but never from two at the same time.
using Progress = std::function<bool(double fraction)>;

}  // namespace marrow
