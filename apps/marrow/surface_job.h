/// The stages that all commands share that make surfaces of a scan in memory.
#pragma once

#include "options.h"
#include "progress_reporter.h"
#include "results.h"
#include "steps.h"

namespace marrow::apps {

/// The options that these commands share.
struct SurfaceJobOptions {
    ScanInput scan;
    MeshOutput output;
    Reporting reporting;
};

/// One run of such a command: it reads and filters the scan, and delivers the surfaces that the command makes
/// of it.
class SurfaceJob {
  public:
    SurfaceJob(const SurfaceJobOptions& options, const Console& console, const std::atomic<bool>& stop);

    /// Checks where the results go, before the work starts. \throw UsageError, IoError
    void check_outputs(const std::vector<std::filesystem::path>& files) const;

    /// Whether a file of one of these names, or the picture, shows normals of points.
    bool shows_normals(const std::vector<std::filesystem::path>& files) const;

    /// Reads the scan, calls `unfiltered` with it, and does the steps before extraction; `before_mixing` is
    /// that of filter_scan. \throw as read_scan and filter_scan
    Volume read_scan(const FilterSteps& steps, const Inspect& unfiltered = {},
                     const Inspect& before_mixing = {});

    /// The same for one volume of the scan.
    Volume read_volume(std::int64_t volume, const FilterSteps& steps);

    /// Runs a stage of the command. Returns its duration in seconds.
    double stage(const char* name, const std::function<void(const Progress&)>& work) const;

    /// Prints the warnings of `results` that were not printed yet.
    void print_warnings();

    /// Writes, verifies, draws and reports the surfaces. \throw IoError, CheckFailed, Cancelled
    void deliver();

    const SurfaceJobOptions& options() const { return options_; }
    int threads() const { return options_.scan.options.threads; }

    SurfaceResults results;

  private:
    Volume read(ScanOptions options, const FilterSteps& steps, const Inspect& unfiltered,
                const Inspect& before_mixing);
    void draw(const Progress& progress);

    const SurfaceJobOptions& options_;
    const ProgressReporter reporter_;
    const Clock::time_point start_ = Clock::now();
    std::size_t printed_warnings_ = 0;
};

}  // namespace marrow::apps
