#include "long_work.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace py = pybind11;

namespace marrow::python {

namespace {

// The work that goes on in the whole process. It is never destroyed, because threads may
// use it until the process ends.
class Running {
  public:
    void begin() {
        const std::scoped_lock lock(mutex_);
        if (shutting_down_) throw Cancelled();
        ++count_;
    }

    void end() {
        const std::scoped_lock lock(mutex_);
        --count_;
        changed_.notify_all();
    }

    bool is_shutting_down() const { return shutting_down_; }

    // After it, threads that the interpreter abandons are not in the middle of C++ code. The limit is for a
    // process that was forked while another thread worked: that thread is not there to end.
    void shut_down() {
        std::unique_lock lock(mutex_);
        shutting_down_ = true;
        changed_.wait_for(lock, std::chrono::seconds(5), [this] { return count_ == 0; });
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    int count_ = 0;
    std::atomic<bool> shutting_down_ = false;
};

Running& running() {
    static Running& all = *new Running;
    return all;
}

// Whether an answer is False, of Python or NumPy: None and numbers are neither true nor false.
bool is_false(const py::object& answer) {
    constexpr bool kConvert = false;
    py::detail::make_caster<bool> truth;
    return truth.load(answer, kConvert) && !py::detail::cast_op<bool>(truth);
}

using Work = std::function<void(const Progress&, const CallPython&)>;

// What the thread of the work and the calling thread tell each other.
class LongWork {
  public:
    LongWork() { running().begin(); }

    ~LongWork() {
        if (thread_.joinable()) thread_.join();
        running().end();
    }

    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

    // Starts the work and waits for its end, on the calling thread. The first report comes before the start,
    // so that even work that takes no time can be cancelled.
    void run(const Work& work, const py::object& progress) {
        report(progress);
        if (cancel_) {
            thrown_ = std::make_exception_ptr(Cancelled());
        } else {
            thread_ = std::thread([this, &work] { do_work(work); });
            wait(progress);
        }
        if (raised_) std::rethrow_exception(raised_);
        if (thrown_) std::rethrow_exception(thrown_);
    }

  private:
    enum class State { works, calls, done };

    void wait(const py::object& progress) {
        for (bool done = false; !done;) {
            const State state = wait_for_change();
            if (state == State::calls) answer();
            report(progress);
            done = state == State::done;
        }
    }

    // On the work's thread.
    void do_work(const Work& work) {
        const auto progress = [this](double fraction) {
            fraction_ = fraction;
            return !cancel_;
        };
        const auto call = [this](const std::function<void()>& function) { call_python(function); };
        try {
            work(progress, call);
        } catch (...) {
            thrown_ = std::current_exception();
        }
        set(State::done);
    }

    // On the work's thread.
    void call_python(const std::function<void()>& function) {
        function_ = &function;
        set(State::calls);
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return state_ == State::works; });
        if (cancel_) throw Cancelled();
    }

    State wait_for_change() {
        constexpr std::chrono::milliseconds kInterval{50};
        const py::gil_scoped_release unlocked;
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, kInterval, [this] { return state_ != State::works; });
        return state_;
    }

    void answer() {
        if (!cancel_) run_python(*function_);
        set(State::works);
    }

    void report(const py::object& progress) {
        if (running().is_shutting_down()) cancel_ = true;
        if (cancel_) return;
        run_python([&] {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (!progress.is_none() && is_false(progress(fraction_.load()))) cancel_ = true;
        });
    }

    // An exception cancels the work.
    void run_python(const std::function<void()>& function) {
        try {
            function();
        } catch (...) {
            raised_ = std::current_exception();
            cancel_ = true;
        }
    }

    void set(State state) {
        const std::scoped_lock lock(mutex_);
        state_ = state;
        changed_.notify_all();
    }

    std::atomic<double> fraction_ = 0;
    std::atomic<bool> cancel_ = false;
    std::mutex mutex_;
    std::condition_variable changed_;
    State state_ = State::works;
    const std::function<void()>* function_ = nullptr;
    std::exception_ptr raised_;  // by Python, on the calling thread
    std::exception_ptr thrown_;  // by the work
    std::thread thread_;
};

}  // namespace

void run_long_work(const py::object& progress, const std::function<void(const Progress&)>& work) {
    run_long_work(progress, [&](const Progress& report, const CallPython&) { work(report); });
}

void run_long_work(const py::object& progress, const Work& work) {
    LongWork().run(work, progress);
}

void stop_long_work_at_exit() {
    py::module_::import("atexit").attr("register")(py::cpp_function([] {
        const py::gil_scoped_release unlocked;
        running().shut_down();
    }));
}

}  // namespace marrow::python
