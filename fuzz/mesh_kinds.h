/// The extensions of the files that the target `mesh` reads, by number. The number after the last is a bare
/// 3MF model.
#pragma once

inline constexpr const char* kMeshKinds[] = {".stl", ".ply", ".obj",    ".vtp",
                                             ".3mf", ".glb", ".obj.gz", ".dcm"};
