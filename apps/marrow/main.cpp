#include <cerrno>
#include <cstring>
#include <iostream>
#include <string_view>

#include <unistd.h>

#include "run.h"
#include "signals.h"

namespace {

// `marrow terrain` is a program of its own, so that scans do not wait until GDAL is loaded.
int become_terrain(char** arguments) {
    const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "marrow-terrain";
    execv(program.c_str(), arguments);
    std::cerr << "marrow: cannot start '" << program.string() << "': " << std::strerror(errno)
              << "; build Marrow with MARROW_TERRAIN for terrain\n";
    return marrow::kUnreadable;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "terrain") return become_terrain(argv + 1);
    const std::atomic<bool>& stop = marrow::stopped_by_signals();
    try {
        const auto parsed = marrow::parse_command_line(argc, argv, std::cout);
        if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
        return marrow::run(std::get<marrow::Settings>(parsed),
                           {std::cout, std::cerr, isatty(STDERR_FILENO) != 0}, stop);
    } catch (const marrow::UsageError& error) {
        std::cerr << "marrow: " << error.what() << '\n';
        return marrow::kUsage;
    }
}
