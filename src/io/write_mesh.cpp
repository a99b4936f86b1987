#include <algorithm>
#include <string>

#include <marrow/mesh_io.h>

#include "mesh_output.h"

namespace marrow {

MeshFormat mesh_format(const std::filesystem::path& output) {
    std::string ending = output.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](char c) { return 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    if (ending == ".stl") return MeshFormat::stl;
    if (ending == ".ply") return MeshFormat::ply;
    if (ending == ".obj") return MeshFormat::obj;
    if (ending == ".vtp") return MeshFormat::vtp;
    throw InputError("cannot write '" + output.string() + "': its ending must be .stl, .ply, .obj or .vtp");
}

void write_mesh(const Mesh& mesh, const std::filesystem::path& output, const MeshWriteOptions& options) {
    const MeshFormat format = mesh_format(output);
    const auto refuse = [&](const std::string& reason) {
        throw InputError("cannot write '" + output.string() + "': " + reason);
    };
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.points.size())
        refuse("the mesh has " + std::to_string(mesh.points.size()) + " points but " +
               std::to_string(mesh.normals.size()) + " normals");
    for (const Triangle& t : mesh.triangles) {
        if (std::max({t[0], t[1], t[2]}) >= mesh.points.size())
            refuse("a triangle of the mesh names a point that is not there");
    }
    AtomicFile file(output);
    MeshOutput to(mesh, file, options);
    if (format == MeshFormat::stl) write_stl(to);
    if (format == MeshFormat::ply) write_ply(to);
    if (format == MeshFormat::obj) write_obj(to);
    if (format == MeshFormat::vtp) write_vtp(to);
    file.commit();
}

}  // namespace marrow
