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
    MeshOutput to(file, options);
    if (format == MeshFormat::stl) {
        write_stl_header(to, mesh.triangles.size());
        write_stl_facets(to, whole(mesh));
    }
    if (format == MeshFormat::ply) {
        to.text(ply_header(options.space, mesh.points.size(), !mesh.normals.empty(), mesh.triangles.size()));
        write_ply_points(to, whole(mesh));
        write_ply_faces(to, whole(mesh));
    }
    if (format == MeshFormat::obj) write_obj(to, mesh);
    if (format == MeshFormat::vtp) write_vtp(to, mesh);
    file.commit();
}

// What a file written part by part holds, and where.
struct SurfaceWriter::State {
    State(const std::filesystem::path& output, const MeshWriteOptions& options)
        : format(mesh_format(output)), file(output), to(file, options) {}

    MeshFormat format;
    AtomicFile file;
    MeshOutput to;
    bool normals = false;
    std::uint64_t points_begin = 0, faces_begin = 0;

    void begin(std::uint64_t points, std::uint64_t triangles, bool has_normals) {
        normals = has_normals;
        if (format == MeshFormat::stl) return write_stl_header(to, triangles);
        const std::string header = ply_header(to.space, points, normals, triangles);
        to.text(header);
        points_begin = header.size();
        faces_begin = points_begin + points * ply_point_bytes(normals);
    }

    void part(const SurfacePart& p) {
        if (format == MeshFormat::stl) {
            file.seek(kStlHeaderBytes + p.first_triangle * kStlFacetBytes);
            return write_stl_facets(to, p);
        }
        file.seek(points_begin + p.first_point * ply_point_bytes(normals));
        write_ply_points(to, p);
        file.seek(faces_begin + p.first_triangle * kPlyFaceBytes);
        write_ply_faces(to, p);
    }
};

SurfaceWriter::SurfaceWriter(const std::filesystem::path& output, const MeshWriteOptions& options) {
    const MeshFormat format = mesh_format(output);
    if (format != MeshFormat::stl && format != MeshFormat::ply) {
        throw InputError(
            "cannot write '" + output.string() +
            "' part by part: its ending must be .stl or .ply; write those, or do without a memory limit");
    }
    state_ = std::make_unique<State>(output, options);
}

SurfaceWriter::~SurfaceWriter() = default;

SurfaceSink SurfaceWriter::sink() {
    return {[this](std::uint64_t points, std::uint64_t triangles, bool normals) {
                state_->begin(points, triangles, normals);
            },
            [this](const SurfacePart& part) { state_->part(part); }};
}

void SurfaceWriter::commit() {
    state_->file.commit();
}

}  // namespace marrow
