// `marrow check`, and the proof of what was written.
#pragma once

#include <filesystem>
#include <span>

#include <marrow/mesh_io.h>

#include "run.h"
#include "voice.h"

namespace marrow {

/// Checks the meshes in settings.inputs and prints what was found. Returns kCheckFailed with settings.strict
/// where one is not sound.
ExitCode check(const Settings& settings, const Console& console, Voice& voice);

/// Reads a file that write_meshes made of these and compares every triangle. \throw CheckFailed where it holds others
void verify(std::span<const MeshObject> objects, const std::filesystem::path& file, Space space);

}  // namespace marrow
