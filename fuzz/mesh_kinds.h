// The files that the target `mesh` takes, by number; after the last comes a 3MF model without its archive.
#pragma once

inline constexpr const char* kMeshKinds[] = {".stl", ".ply", ".obj", ".vtp", ".3mf", ".glb", ".obj.gz"};
