#include <cerrno>
#include <cstring>
#include <iostream>
#include <string_view>

#include <unistd.h>

#include "run.h"
#include "signals.h"

namespace {

// `marrow terrain` and `marrow view` are programs of their own, so that scans do not wait until GDAL or Qt is loaded.
int become(const char* name, const char* option, char** arguments) {
    const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
    execv(program.c_str(), arguments);
    std::cerr << "marrow: cannot start '" << program.string() << "': " << std::strerror(errno)
              << "; build Marrow with " << option << "\n";
    return marrow::kUnreadable;
}

}  // namespace

int main(int argc, char** argv) {
    const std::string_view first = argc > 1 ? argv[1] : "";
    if (first == "terrain") return become("marrow-terrain", "MARROW_TERRAIN", argv + 1);
    if (first == "view") return become("marrow-viewer", "MARROW_VIEWER", argv + 1);
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
