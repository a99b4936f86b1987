#include "long_work.h"

#include <atomic>
#include <chrono>
#include <future>
#include <optional>

namespace py = pybind11;

namespace marrow::python {

void run_long_work(const py::object& progress, const std::function<void(const Progress&)>& work) {
    constexpr std::chrono::milliseconds kInterval{50};
    std::atomic<double> fraction = 0;
    std::atomic<bool> cancel = false;
    std::optional<py::error_already_set> raised;
    std::future<void> result = std::async(std::launch::async, [&] {
        work([&](double done) {
            fraction = done;
            return !cancel;
        });
    });
    const auto report = [&] {
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (!progress.is_none() && progress(fraction.load()).is(py::bool_(false))) cancel = true;
        } catch (py::error_already_set& e) {
            raised.emplace(e);
            cancel = true;
        }
    };
    for (bool done = false; !done;) {
        {
            const py::gil_scoped_release unlocked;
            done = result.wait_for(kInterval) == std::future_status::ready;
        }
        if (!cancel) report();
    }
    if (raised) {
        try {
            result.get();
        } catch (const Cancelled&) {  // the exception that asked for it goes on instead
        }
        throw *raised;
    }
    result.get();
}

}  // namespace marrow::python
