/// How long work reports how far it is, and how it is stopped.
#pragma once

#include <functional>

#include <marrow/error.h>

namespace marrow {

/// Called now and then with the fraction done, from 0 to 1; returns false to stop the work.
/// It may be called from worker threads, but never from two at once. The work then throws Cancelled.
using Progress = std::function<bool(double fraction)>;

}  // namespace marrow
