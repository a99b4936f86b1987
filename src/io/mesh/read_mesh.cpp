// Reads a mesh file by the reader of its format, converts it to LPS, and takes its objects apart.
#include <algorithm>
#include <limits>

#include <marrow/error.h>
#include <marrow/mesh_io.h>

#include "io/bytes/text.h"
#include "io/dicom/encapsulated_stl.h"
#include "reader.h"
#include "writer.h"

namespace marrow {

using namespace internal::io;

namespace {

// Reads the STL file in a DICOM object, whose frame of reference is in LPS.
Mesh read_dicom(const std::filesystem::path& path, Space& space, const Progress& progress) {
    EncapsulatedStl stl = read_encapsulated_stl(path);
    Mesh mesh = read_stl({path, std::move(stl.bytes)}, space, progress);
    for (Vec3f& p : mesh.points) {
        for (float& coordinate : p) coordinate = static_cast<float>(coordinate * stl.scale);
    }
    space = Space::LPS;
    return mesh;
}

Mesh read(const std::filesystem::path& path, Space* stated, std::vector<ObjectStart>& objects,
          const Progress& progress) {
    const MeshFormat format = mesh_format(path);
    const FileContent input =
        format == MeshFormat::dicom
            ? FileContent{path, {}}
            : read_content(path, is_gzipped(path) ? Compression::zlib : Compression::none);
    Space space = Space::none;
    Mesh mesh;
    if (format == MeshFormat::stl) mesh = read_stl(input, space, progress);
    if (format == MeshFormat::ply) mesh = read_ply(input, space, progress);
    if (format == MeshFormat::obj) mesh = read_obj(input, space, objects, progress);
    if (format == MeshFormat::vtp) mesh = read_vtp(input, space, objects, progress);
    if (format == MeshFormat::threemf) mesh = read_3mf(input, space, objects, progress);
    if (format == MeshFormat::glb) mesh = read_glb(input, space, objects, progress);
    if (format == MeshFormat::dicom) mesh = read_dicom(path, space, progress);
    check_finite(input, mesh.points);
    if (mesh.points.size() >> 32) throw LimitError(quoted(path) + ": has 2^32 points or more");
    if (space == Space::RAS) {
        for (Vec3f& p : mesh.points) p = {-p[0], -p[1], p[2]};
    }
    if (stated) *stated = space;
    return mesh;
}

// The triangles of an object, and the points from its lowest to its highest.
struct Part {
    std::size_t first_triangle, last_triangle;
    std::uint32_t lowest, highest;
};

Part part_of(const Mesh& mesh, std::size_t first, std::size_t last) {
    Part part{first, last, std::numeric_limits<std::uint32_t>::max(), 0};
    for (std::size_t i = first; i < last; ++i) {
        for (const std::uint32_t p : mesh.triangles[i]) {
            part.lowest = std::min(part.lowest, p);
            part.highest = std::max(part.highest, p);
        }
    }
    return part;
}

// The mesh of a part, without points that it does not use.
Mesh cut_out(const Mesh& mesh, const Part& part) {
    std::vector<std::uint32_t> number(std::size_t{part.highest} - part.lowest + 1, 0);
    for (std::size_t i = part.first_triangle; i < part.last_triangle; ++i) {
        for (const std::uint32_t p : mesh.triangles[i]) number[p - part.lowest] = 1;
    }
    Mesh result;
    for (std::size_t p = 0; p < number.size(); ++p) {
        if (number[p] == 0) continue;
        number[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(mesh.points[part.lowest + p]);
    }
    for (std::size_t i = part.first_triangle; i < part.last_triangle; ++i) {
        Triangle t = mesh.triangles[i];
        for (std::uint32_t& p : t) p = number[p - part.lowest];
        result.triangles.push_back(t);
    }
    return result;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& path, Space* stated, const Progress& progress) {
    std::vector<ObjectStart> objects;
    return read(path, stated, objects, progress);
}

std::vector<NamedMesh> read_meshes(const std::filesystem::path& path, Space* stated,
                                   const Progress& progress) {
    std::vector<ObjectStart> objects;
    Mesh all = read(path, stated, objects, progress);
    if (objects.empty() || objects.front().triangle > 0) objects.insert(objects.begin(), ObjectStart{});
    std::vector<Part> parts;
    std::vector<std::string> names;
    bool separate = true;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const std::size_t first = objects[i].triangle,
                          last = i + 1 < objects.size() ? objects[i + 1].triangle : all.triangles.size();
        if (first == last) continue;
        const Part part = part_of(all, first, last);
        separate = separate && (parts.empty() || part.lowest > parts.back().highest);
        parts.push_back(part);
        names.push_back(std::move(objects[i].name));
    }
    std::vector<NamedMesh> meshes;
    if (parts.size() < 2 || !separate) {
        meshes.push_back({parts.size() == 1 ? names.front() : std::string(), std::move(all)});
        return meshes;
    }
    for (std::size_t i = 0; i < parts.size(); ++i) meshes.push_back({names[i], cut_out(all, parts[i])});
    return meshes;
}

}  // namespace marrow
