// Prints errors and warnings, and turns errors into exit codes.
#include "console.h"

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/poll.h>
#include <unistd.h>

#include <marrow/printable.h>

#include "library_options.h"

namespace marrow::apps {
namespace {

constexpr std::string_view kRed = "\x1b[1;31m", kYellow = "\x1b[1;33m", kPlain = "\x1b[0m";

void print_line(const Console& console, std::string_view colour, std::string_view prefix,
                std::string_view text) {
    if (console.colour)
        console.err << colour << prefix << kPlain;
    else
        console.err << prefix;
    console.err << ' ' << printable(text) << '\n';
}

bool wants_colour() {
    const char* no_colour = std::getenv("NO_COLOR");
    const char* terminal = std::getenv("TERM");
    return (!no_colour || *no_colour == '\0') && terminal && std::string_view(terminal) != "dumb";
}

// A file that is opened later would take the number of a closed stream, and receive what is printed there.
// Writing to standard output must still fail, so that lost results are noticed.
void open_closed_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (fcntl(stream, F_GETFD) == -1) open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
    }
}

// Whether standard output is a pipe whose reader has left, such as `head` when it has enough.
bool reader_has_left() {
    pollfd output{STDOUT_FILENO, POLLOUT, 0};
    return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

std::string message_of(const std::exception& error) {
    if (dynamic_cast<const std::bad_alloc*>(&error)) return "not enough memory for this input";
    if (const auto* of_file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
        return fmt::format("'{}': {}", of_file->path1().string(), of_file->code().message());
    return name_flags(error.what());
}

}  // namespace

void Console::error(std::string_view text) const {
    print_line(*this, kRed, "marrow:", text);
}

void Console::warning(std::string_view text) const {
    print_line(*this, kYellow, "marrow: warning:", text);
}

Console standard_console() {
    open_closed_streams();
    const bool terminal = isatty(STDERR_FILENO) != 0;
    return {std::cout, std::cerr, terminal, terminal && wants_colour()};
}

ExitCode exit_code_of(const std::exception& error) {
    const auto* const e = &error;
    if (dynamic_cast<const Cancelled*>(e)) return kCancelled;
    if (dynamic_cast<const UsageError*>(e) || dynamic_cast<const OptionError*>(e)) return kUsage;
    if (dynamic_cast<const EmptySurface*>(e)) return kEmpty;
    if (dynamic_cast<const CheckFailed*>(e)) return kCheckFailed;
    if (dynamic_cast<const GeometryError*>(e)) return kGeometry;
    return kUnreadable;
}

int exit_code_of(const Console& console, const std::function<ExitCode()>& work,
                 const std::function<void(const std::string& message, ExitCode)>& on_error) {
    try {
        const ExitCode code = work();
        console.out.flush();
        if (!console.out && reader_has_left()) return kUnreadable;  // and expects no message
        if (!console.out) throw IoError("cannot write the results to standard output");
        return code;
    } catch (const std::exception& error) {
        const std::string message = message_of(error);
        const ExitCode code = exit_code_of(error);
        console.error(message);
        if (on_error) on_error(message, code);
        return code;
    }
}

}  // namespace marrow::apps
