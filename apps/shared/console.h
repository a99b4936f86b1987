/// Where the programs print, how they show errors, and their exit codes.
#pragma once

#include <exception>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>

#include <marrow/error.h>

namespace marrow::apps {

/// Exit codes. The same fault has the same code in every command and format; the footer of --help lists them.
enum ExitCode {
    kOk = 0,
    kUsage = 2,  ///< the command line is wrong, by itself or for this input: UsageError, OptionError
    /// an input is missing, damaged, not supported or too large, an output fails, or there is no such device
    kUnreadable = 3,
    kGeometry = 4,  ///< the input is ambiguous, or its geometry would distort the result: GeometryError
    kEmpty = 5,     ///< there is no surface: EmptySurface
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

/// The console of this process. Call it before files are opened: standard streams that are closed become
/// /dev/null. Colours are used on a terminal, unless NO_COLOR is set (see no-color.org) or TERM is "dumb".
Console standard_console();

/// The exit code of an error, as the comments at the codes say.
ExitCode exit_code_of(const std::exception& error);

/// Does the work and returns its exit code. Errors become one line on console.err, and then an argument of
/// `on_error`. If a reader of standard output closes its pipe early, there is no such line.
int exit_code_of(const Console& console, const std::function<ExitCode()>& work,
                 const std::function<void(const std::string& message, ExitCode)>& on_error = {});

}  // namespace marrow::apps
