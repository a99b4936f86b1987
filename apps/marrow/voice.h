// What the command line says while it works and when it fails.
#pragma once

#include <atomic>
#include <chrono>
#include <new>
#include <ostream>
#include <string>

#include <fmt/format.h>

#include <marrow/error.h>
#include <marrow/progress.h>

#include "report_progress.h"
#include "run.h"

namespace marrow {

/// No sample lies across the isovalue.
struct EmptySurface : Error {
    using Error::Error;
};

/// What was written is not what was to be written.
struct CheckFailed : Error {
    using Error::Error;
};

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The words on stderr, and the flag that stops the work.
class Voice {
  public:
    Voice(bool quiet, bool verbose, const Console& console, const std::atomic<bool>& stop)
        : quiet_(quiet), verbose_(verbose), console_(console), stop_(stop) {}

    void warn(const std::string& text) {
        if (!quiet_) console_.err << "marrow: warning: " << text << '\n';
    }

    /// Does a stage's work, with a bar where err is a terminal, and returns the seconds it took.
    template <class Work>
    double stage(const char* name, Work work) {
        const bool bar = console_.terminal && !quiet_;
        const Clock::time_point start = Clock::now();
        Clock::time_point drawn = start;
        const Progress progress = [&](double fraction) {
            if (bar && seconds_since(drawn) > 0.1) {
                drawn = Clock::now();
                draw(name, fraction);
            }
            return !stop_.load(std::memory_order_relaxed);
        };
        const auto erase = [&] {
            if (drawn != start) console_.err << "\r\x1b[K" << std::flush;
        };
        try {
            report(progress, 0);
            work(progress);
        } catch (...) {
            erase();
            throw;
        }
        erase();
        const double seconds = seconds_since(start);
        if (verbose_ && !quiet_) console_.err << fmt::format("{:<8} {:8.3f} s\n", name, seconds);
        return seconds;
    }

  private:
    void draw(const char* name, double fraction) {
        constexpr int kWidth = 40;
        const int done = static_cast<int>(fraction * kWidth);
        console_.err << fmt::format("\r{:<8} [{:#<{}}{:.<{}}] {:3.0f}%", name, "", done, "", kWidth - done,
                                    fraction * 100)
                     << std::flush;
    }

    const bool quiet_, verbose_;
    const Console& console_;
    const std::atomic<bool>& stop_;
};

/// Does the work and returns its exit code; errors become one line on console.err.
template <class Work>
int exit_code_of(const Console& console, Work work) {
    const auto fail = [&](ExitCode code, const char* what) {
        console.err << "marrow: " << what << '\n';
        return code;
    };
    try {
        const ExitCode code = work();
        console.out.flush();
        if (!console.out) throw IoError("cannot write the results to standard output");
        return code;
    } catch (const Cancelled& error) {
        return fail(kCancelled, error.what());
    } catch (const UsageError& error) {
        return fail(kUsage, error.what());
    } catch (const EmptySurface& error) {
        return fail(kEmpty, error.what());
    } catch (const CheckFailed& error) {
        return fail(kCheckFailed, error.what());
    } catch (const GeometryError& error) {
        return fail(kGeometry, error.what());
    } catch (const Error& error) {
        return fail(kUnreadable, error.what());
    } catch (const std::bad_alloc&) {
        return fail(kUnreadable, "not enough memory for this input");
    } catch (const std::exception& error) {
        return fail(kUnreadable, error.what());
    }
}

}  // namespace marrow
