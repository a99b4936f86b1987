// Reads a mesh file by the reader of its format, and converts it to LPS.
#include <marrow/error.h>
#include <marrow/mesh_io.h>

#include "io/bytes/text.h"
#include "io/dicom/encapsulated_stl.h"
#include "reader.h"
#include "writer.h"

namespace marrow {

namespace {

// Reads the STL file in a DICOM object, whose frame of reference is in LPS.
Mesh read_dicom(const std::filesystem::path& path, Space& space) {
    using namespace internal::io;
    EncapsulatedStl stl = read_encapsulated_stl(path);
    Mesh mesh = read_stl({path, std::move(stl.bytes)}, space);
    for (Vec3f& p : mesh.points) {
        for (float& coordinate : p) coordinate = static_cast<float>(coordinate * stl.scale);
    }
    space = Space::LPS;
    return mesh;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& path, Space* stated) {
    using namespace internal::io;
    const MeshFormat format = mesh_format(path);
    const FileContent input =
        format == MeshFormat::dicom
            ? FileContent{path, {}}
            : read_content(path, is_gzipped(path) ? Compression::zlib : Compression::none);
    Space space = Space::none;
    Mesh mesh;
    if (format == MeshFormat::stl) mesh = read_stl(input, space);
    if (format == MeshFormat::ply) mesh = read_ply(input, space);
    if (format == MeshFormat::obj) mesh = read_obj(input, space);
    if (format == MeshFormat::vtp) mesh = read_vtp(input, space);
    if (format == MeshFormat::threemf) mesh = read_3mf(input, space);
    if (format == MeshFormat::glb) mesh = read_glb(input, space);
    if (format == MeshFormat::dicom) mesh = read_dicom(path, space);
    check_finite(input, mesh.points);
    if (mesh.points.size() >> 32) throw LimitError(quoted(path) + ": has 2^32 points or more");
    if (space == Space::RAS) {
        for (Vec3f& p : mesh.points) p = {-p[0], -p[1], p[2]};
    }
    if (stated) *stated = space;
    return mesh;
}

}  // namespace marrow
