/// Runs long work without the interpreter's lock, so that Ctrl-C, progress and other
/// Python threads go on meanwhile.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

#include <marrow/progress.h>

namespace marrow::python {

/// Calls work(progress) on a thread of its own and waits for it without the interpreter's lock. Before it
/// starts the work, every 50 ms, and at the end, the calling thread takes the lock, handles signals, and
/// calls `progress` with the fraction that is done, unless it is None. An exception from a signal handler or
/// from `progress`, or its return value False, cancels the work: the exception goes on to the caller once the
/// work has stopped.
///
/// No Python code runs on other threads: they could wait for a lock that the caller holds. \pre the caller
/// holds the lock, and `work` touches no Python object
void run_long_work(const pybind11::object& progress, const std::function<void(const Progress&)>& work);

/// Returns function(progress), which run_long_work calls.
template <class Function>
auto compute(const pybind11::object& progress, const Function& function) {
    std::optional<std::invoke_result_t<const Function&, const Progress&>> result;
    run_long_work(progress, [&](const Progress& report) { result.emplace(function(report)); });
    return std::move(*result);
}

/// Runs a function on the thread that called run_long_work, which takes the interpreter's lock for it, and
/// waits until it has returned. The work's own thread calls it. \throw Cancelled the function raised a Python
/// exception, which then goes on to the caller as above
using CallPython = std::function<void(const std::function<void()>& function)>;

/// As above, for work that needs Python in between.
void run_long_work(const pybind11::object& progress,
                   const std::function<void(const Progress&, const CallPython&)>& work);

/// Cancels, when the interpreter shuts down, the work of threads that it does not wait for.
void stop_long_work_at_exit();

}  // namespace marrow::python
