// `marrow check`, and the proof of what was written.
#pragma once

#include <marrow/mesh.h>

#include "run.h"
#include "voice.h"

namespace marrow {

/// Checks the meshes in settings.inputs and prints what was found. Returns kCheckFailed with settings.strict
/// where one is not sound.
ExitCode check(const Settings& settings, const Console& console, Voice& voice);

/// Reads a file that write_mesh made of `mesh` and compares. \throw CheckFailed where it is another mesh
void verify(const Mesh& mesh, const std::filesystem::path& file, Space space);

}  // namespace marrow
