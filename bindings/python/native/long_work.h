/// Runs long work without the interpreter's lock, so that Ctrl-C, progress and other Python threads go on meanwhile.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>

#include <marrow/progress.h>

namespace marrow::python {

/// Calls work(progress) on a thread of its own and waits for it without the interpreter's lock. Every 50 ms the calling
/// thread takes the lock, handles signals, and calls `progress` with the fraction that is done, unless it is None. An
/// exception from a signal handler or from `progress`, or its return value False, cancels the work: the exception goes on
/// to the caller once the work has stopped.
///
/// No Python code runs on other threads: they could wait for a lock that the caller holds. \pre the caller holds the
/// lock, and `work` touches no Python object
void run_long_work(const pybind11::object& progress, const std::function<void(const Progress&)>& work);

}  // namespace marrow::python
