/// Shows the progress of each stage and passes on the wish to stop.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include <marrow/progress.h>

#include "options.h"
#include "shared/console.h"

namespace marrow::apps {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start);

/// Runs the stages of a command with a progress bar, their times, and warnings.
class ProgressReporter {
  public:
    /// The work ends with Cancelled soon after `stop` becomes true.
    ProgressReporter(const Reporting& reporting, const Console& console, const std::atomic<bool>& stop)
        : reporting_(reporting), console_(console), stop_(stop) {}

    const Console& console() const { return console_; }
    const Reporting& reporting() const { return reporting_; }

    void warn(const std::string& text) const;

    /// Runs one stage, with a bar where standard error is a terminal, and returns its duration in seconds.
    double stage(const char* name, const std::function<void(const Progress&)>& work) const;

  private:
    void draw(const char* name, double fraction) const;

    const Reporting reporting_;
    const Console& console_;
    const std::atomic<bool>& stop_;
};

}  // namespace marrow::apps
