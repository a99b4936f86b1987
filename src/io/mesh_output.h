// What the mesh writers share: where the bytes go, in which space, and how far along they are.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include <marrow/atomic_file.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/slabs.h>

namespace marrow {

static_assert(std::endian::native == std::endian::little, "binary meshes are written as they lie in memory");

/// The mark that written meshes carry.
inline std::string space_mark(Space space) {
    return space == Space::RAS ? "SPACE=RAS UNITS=mm" : "SPACE=LPS UNITS=mm";
}

/// Copies a value's bytes to `to` and returns the end.
template <class T>
char* put(char* to, const T& value) {
    std::memcpy(to, &value, sizeof value);
    return to + sizeof value;
}

/// Surfaces on their way into a file.
class MeshOutput {
  public:
    MeshOutput(AtomicFile& file, const MeshWriteOptions& options)
        : space(options.space), file_(file), progress_(options.progress) {}

    const Space space;

    /// A point or normal in the space that is written.
    Vec3f oriented(const Vec3f& v) const { return space == Space::RAS ? Vec3f{-v[0], -v[1], v[2]} : v; }

    void text(const std::string& text) { file_.write(text); }

    /// Writes items 0 to count - 1 in large pieces: `encode(i, to)` puts at most `MaxBytes` at `to` and
    /// returns the end. Progress goes from `from` to `until`.
    template <std::size_t MaxBytes, class Encode>
    void items(std::size_t count, double from, double until, Encode encode) {
        constexpr std::size_t kPiece = (std::size_t{1} << 20) / MaxBytes;
        piece_.resize(kPiece * MaxBytes);
        for (std::size_t first = 0; first < count; first += kPiece) {
            const std::size_t last = std::min(first + kPiece, count);
            char* end = piece_.data();
            for (std::size_t i = first; i < last; ++i) end = encode(i, end);
            file_.write(piece_.data(), static_cast<std::size_t>(end - piece_.data()));
            report(progress_, from + (until - from) * static_cast<double>(last) / static_cast<double>(count));
        }
    }

  private:
    AtomicFile& file_;
    const Progress& progress_;
    std::vector<char> piece_;
};

/// A whole mesh as the only part of its surface.
inline SurfacePart whole(const Mesh& mesh) {
    return {0, mesh.points, mesh.normals, 0, mesh.triangles};
}

void write_obj(MeshOutput& output, const Mesh& mesh);
void write_vtp(MeshOutput& output, const Mesh& mesh);

// STL and PLY have records of one size, so that a surface can also be written part by part.
void write_stl_header(MeshOutput& output, std::uint64_t triangles);
void write_stl_facets(MeshOutput& output, const SurfacePart& part);
inline constexpr std::uint64_t kStlHeaderBytes = 84, kStlFacetBytes = 50;

/// The text before the points.
std::string ply_header(Space space, std::uint64_t points, bool normals, std::uint64_t triangles);
void write_ply_points(MeshOutput& output, const SurfacePart& part);
void write_ply_faces(MeshOutput& output, const SurfacePart& part);
inline constexpr std::uint64_t kPlyFaceBytes = 13;
constexpr std::uint64_t ply_point_bytes(bool normals) {
    return normals ? 24 : 12;
}

}  // namespace marrow
