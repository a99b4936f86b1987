// The program `marrow-terrain`, which `marrow terrain` starts.
#include "commands/terrain.h"
#include "shared/console.h"
#include "signals.h"

int main(int argc, char** argv) {
    return marrow::cli::run_terrain(argc, argv, marrow::cli::standard_console(),
                                    marrow::cli::stopped_by_signals());
}
