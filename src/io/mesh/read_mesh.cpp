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
Mesh read_dicom(const std::filesystem::path& path, Space& space) {
    EncapsulatedStl stl = read_encapsulated_stl(path);
    Mesh mesh = read_stl({path, std::move(stl.bytes)}, space);
    for (Vec3f& p : mesh.points) {
        for (float& coordinate : p) coordinate = static_cast<float>(coordinate * stl.scale);
    }
    space = Space::LPS;
    return mesh;
}

Mesh read(const std::filesystem::path& path, Space* stated, std::vector<ObjectStart>& objects) {
    const MeshFormat format = mesh_format(path);
    const FileContent input =
        format == MeshFormat::dicom
            ? FileContent{path, {}}
            : read_content(path, is_gzipped(path) ? Compression::zlib : Compression::none);
    Space space = Space::none;
    Mesh mesh;
    if (format == MeshFormat::stl) mesh = read_stl(input, space);
    if (format == MeshFormat::ply) mesh = read_ply(input, space);
    if (format == MeshFormat::obj) mesh = read_obj(input, space, objects);
    if (format == MeshFormat::vtp) mesh = read_vtp(input, space, objects);
    if (format == MeshFormat::threemf) mesh = read_3mf(input, space, objects);
    if (format == MeshFormat::glb) mesh = read_glb(input, space, objects);
    if (format == MeshFormat::dicom) mesh = read_dicom(path, space);
    check_finite(input, mesh.points);
    if (mesh.points.size() >> 32) throw LimitError(quoted(path) + ": has 2^32 points or more");
    if (space == Space::RAS) {
        for (Vec3f& p : mesh.points) p = {-p[0], -p[1], p[2]};
    }
    if (stated) *stated = space;
    return mesh;
}

// Triangles [first, last) with the points that they use.
Mesh part_of(const Mesh& mesh, std::size_t first, std::size_t last) {
    constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t lowest = kUnused, highest = 0;
    for (std::size_t i = first; i < last; ++i) {
        const auto [low, high] = std::minmax_element(mesh.triangles[i].begin(), mesh.triangles[i].end());
        lowest = std::min(lowest, *low), highest = std::max(highest, *high);
    }
    std::vector<std::uint32_t> number(std::size_t{highest} - lowest + 1, kUnused);
    for (std::size_t i = first; i < last; ++i) {
        for (const std::uint32_t p : mesh.triangles[i]) number[p - lowest] = 0;
    }
    Mesh part;
    for (std::size_t p = 0; p < number.size(); ++p) {
        if (number[p] == kUnused) continue;
        number[p] = static_cast<std::uint32_t>(part.points.size());
        part.points.push_back(mesh.points[lowest + p]);
    }
    for (std::size_t i = first; i < last; ++i) {
        Triangle t = mesh.triangles[i];
        for (std::uint32_t& p : t) p = number[p - lowest];
        part.triangles.push_back(t);
    }
    return part;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& path, Space* stated) {
    std::vector<ObjectStart> objects;
    return read(path, stated, objects);
}

std::vector<NamedMesh> read_meshes(const std::filesystem::path& path, Space* stated) {
    std::vector<ObjectStart> objects;
    Mesh all = read(path, stated, objects);
    if (objects.empty() || objects.front().triangle > 0) objects.insert(objects.begin(), ObjectStart{});
    std::vector<NamedMesh> meshes;
    std::size_t points = 0;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const std::size_t first = objects[i].triangle,
                          last = i + 1 < objects.size() ? objects[i + 1].triangle : all.triangles.size();
        if (first == last) continue;
        meshes.push_back({std::move(objects[i].name), part_of(all, first, last)});
        points += meshes.back().mesh.points.size();
    }
    if (meshes.size() > 1 && points <= all.points.size()) return meshes;
    std::string name = meshes.size() == 1 ? std::move(meshes.front().name) : std::string();
    meshes.clear();
    meshes.push_back({std::move(name), std::move(all)});
    return meshes;
}

}  // namespace marrow
