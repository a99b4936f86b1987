// The program `marrow-terrain`, which `marrow terrain` starts.
#include "commands/terrain.h"
#include "shared/console.h"
#include "signals.h"

int main(int argc, char** argv) {
    return marrow::apps::run_terrain(argc, argv, marrow::apps::standard_console(),
                                     marrow::apps::stopped_by_signals());
}
