// Prints errors and warnings, and turns errors into exit codes.
#include "console.h"

#include <cstdlib>
#include <iostream>
#include <new>

#include <unistd.h>

#include "shared/library_options.h"

namespace marrow::cli {
namespace {

constexpr std::string_view kRed = "\x1b[1;31m", kYellow = "\x1b[1;33m", kPlain = "\x1b[0m";

void print_line(const Console& console, std::string_view colour, std::string_view prefix,
                std::string_view text) {
    if (console.colour)
        console.err << colour << prefix << kPlain;
    else
        console.err << prefix;
    console.err << ' ' << text << '\n';
}

bool wants_colour() {
    const char* no_colour = std::getenv("NO_COLOR");
    const char* terminal = std::getenv("TERM");
    return (!no_colour || *no_colour == '\0') && terminal && std::string_view(terminal) != "dumb";
}

}  // namespace

void Console::error(std::string_view text) const {
    print_line(*this, kRed, "marrow:", text);
}

void Console::warning(std::string_view text) const {
    print_line(*this, kYellow, "marrow: warning:", text);
}

Console standard_console() {
    const bool terminal = isatty(STDERR_FILENO) != 0;
    return {std::cout, std::cerr, terminal, terminal && wants_colour()};
}

int exit_code_of(const Console& console, const std::function<ExitCode()>& work) {
    const auto fail = [&](ExitCode code, const std::exception& error) {
        console.error(apps::name_flags(error.what()));
        return code;
    };
    try {
        const ExitCode code = work();
        console.out.flush();
        if (!console.out) throw IoError("cannot write the results to standard output");
        return code;
    } catch (const Cancelled& error) {
        return fail(kCancelled, error);
    } catch (const UsageError& error) {
        return fail(kUsage, error);
    } catch (const EmptySurface& error) {
        return fail(kEmpty, error);
    } catch (const CheckFailed& error) {
        return fail(kCheckFailed, error);
    } catch (const GeometryError& error) {
        return fail(kGeometry, error);
    } catch (const std::bad_alloc&) {
        return fail(kUnreadable, LimitError("not enough memory for this input"));
    } catch (const std::exception& error) {
        return fail(kUnreadable, error);
    }
}

}  // namespace marrow::cli
