// Draws progress bars and prints the times of stages.
#include "progress_reporter.h"

#include <ostream>

#include <fmt/format.h>

#include "shared/library_options.h"
#include "shared/report_progress.h"

namespace marrow::apps {

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

void ProgressReporter::warn(const std::string& text) const {
    if (!reporting_.quiet) console_.warning(name_flags(text));
}

double ProgressReporter::stage(const char* name, const std::function<void(const Progress&)>& work) const {
    const bool bar = console_.terminal && !reporting_.quiet;
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
    if (reporting_.verbose && !reporting_.quiet)
        console_.err << fmt::format("{:<8} {:8.3f} s\n", name, seconds);
    return seconds;
}

void ProgressReporter::draw(const char* name, double fraction) const {
    constexpr int kWidth = 40;
    const int done = static_cast<int>(fraction * kWidth);
    console_.err << fmt::format("\r{:<8} [{:#<{}}{:.<{}}] {:3.0f}%", name, "", done, "", kWidth - done,
                                fraction * 100)
                 << std::flush;
}

}  // namespace marrow::apps
