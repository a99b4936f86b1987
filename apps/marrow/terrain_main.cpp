#include <iostream>

#include <unistd.h>

#include "signals.h"
#include "terrain.h"

int main(int argc, char** argv) {
    const std::atomic<bool>& stop = marrow::stopped_by_signals();
    try {
        const auto parsed = marrow::parse_terrain_command(argc, argv, std::cout);
        if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
        return marrow::run_terrain(std::get<marrow::TerrainSettings>(parsed),
                                   {std::cout, std::cerr, isatty(STDERR_FILENO) != 0}, stop);
    } catch (const marrow::UsageError& error) {
        std::cerr << "marrow: " << error.what() << '\n';
        return marrow::kUsage;
    }
}
