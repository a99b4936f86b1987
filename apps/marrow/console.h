/// Where the programs print, how they show errors, and their exit codes.
#pragma once

#include <functional>
#include <iosfwd>
#include <string_view>

#include <marrow/error.h>

namespace marrow::cli {

/// Exit codes; see the footer of --help.
enum ExitCode {
    kOk = 0,
    kUsage = 2,
    kUnreadable = 3,
    kGeometry = 4,
    kEmpty = 5,
    kCheckFailed = 6,
    kCancelled = 130
};

/// The command line does not make sense, by itself or for this scan.
struct UsageError : Error {
    using Error::Error;
};

/// There is no surface to write.
struct EmptySurface : Error {
    using Error::Error;
};

/// A file does not hold what was written to it.
struct CheckFailed : Error {
    using Error::Error;
};

/// The streams that a program prints to.
struct Console {
    std::ostream& out;      ///< results
    std::ostream& err;      ///< errors, warnings, progress
    bool terminal = false;  ///< `err` is a terminal: draw progress bars
    bool colour = false;    ///< print the prefixes of errors and warnings in colour

    /// Prints one line, "marrow: TEXT".
    void error(std::string_view text) const;

    /// Prints one line, "marrow: warning: TEXT".
    void warning(std::string_view text) const;
};

/// The console of this process. Colours are used on a terminal, unless NO_COLOR is set (see no-color.org) or TERM is
/// "dumb".
Console standard_console();

/// Does the work and returns its exit code. Errors become one line on console.err.
int exit_code_of(const Console& console, const std::function<ExitCode()>& work);

}  // namespace marrow::cli
