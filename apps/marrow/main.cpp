// The program `marrow`.
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include <unistd.h>

#include "commands/dispatch.h"
#include "report.h"
#include "shared/console.h"
#include "signals.h"

namespace {

using namespace marrow::apps;

// A command that is a program of its own, so that other commands do not wait until GDAL or Qt is loaded.
struct SiblingProgram {
    std::string_view command;
    const char* name;
    const char* how_to_get_it;
};

constexpr SiblingProgram kSiblings[] = {
    {"terrain", "marrow-terrain",
     "'marrow terrain' is not installed; build it with MARROW_TERRAIN=ON or install the package "
     "marrow-terrain"},
    {"view", "marrow-viewer",
     "the viewer is not installed; build it with 'make viewer' or install the package marrow-viewer"},
};

// Replaces this process by the program beside it. Returns only if that fails.
int become(const SiblingProgram& sibling, int argc, char* const* arguments) {
    const Console console = standard_console();
    const auto start = [&]() -> ExitCode {
        const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / sibling.name;
        execv(program.c_str(), arguments);
        throw marrow::IoError(errno == ENOENT
                                  ? sibling.how_to_get_it
                                  : "cannot start '" + program.string() + "': " + std::strerror(errno));
    };
    return exit_code_of(console, start, error_printer(argc, arguments, console.out));
}

}  // namespace

int main(int argc, char** argv) {
    const std::string_view first = argc > 1 ? argv[1] : "", second = argc > 2 ? argv[2] : "";
    for (const SiblingProgram& sibling : kSiblings) {
        if (first == sibling.command) return become(sibling, argc - 1, argv + 1);
        std::string help = "--help";
        char* const help_arguments[] = {argv[0], help.data(), nullptr};
        if (first == "help" && second == sibling.command && argc == 3)
            return become(sibling, 2, help_arguments);
    }
    return run_marrow(argc, argv, standard_console(), stopped_by_signals());
}
