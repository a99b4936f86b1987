// What the mesh writers share: where the bytes go, in which space, and how far along they are.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/streaming.h>

#include "base/progress.h"

namespace marrow {

static_assert(std::endian::native == std::endian::little, "binary meshes are written as they lie in memory");

/// The mark that written meshes carry.
inline std::string space_mark(Space space) {
    if (space == Space::none) return "UNITS=mm";
    return space == Space::RAS ? "SPACE=RAS UNITS=mm" : "SPACE=LPS UNITS=mm";
}

/// Copies a value's bytes to `to` and returns the end.
template <class T>
char* put(char* to, const T& value) {
    std::memcpy(to, &value, sizeof value);
    return to + sizeof value;
}

/// Whether a mesh file of that name is compressed.
bool is_gzipped(const std::filesystem::path& file);

/// Surfaces on their way into a file.
class MeshOutput {
  public:
    using Write = std::function<void(const void* data, std::size_t bytes)>;

    MeshOutput(Write write, const MeshWriteOptions& options)
        : space(options.space), write_(std::move(write)), progress_(options.progress) {}

    const Space space;

    /// A point or normal in the space that is written.
    Vec3f oriented(const Vec3f& v) const { return space == Space::RAS ? Vec3f{-v[0], -v[1], v[2]} : v; }

    void text(const std::string& text) { write_(text.data(), text.size()); }

    /// From now on, progress from 0 to 1 is that of object `index` of so many.
    void set_share(std::size_t index, std::size_t objects) {
        share_begin_ = static_cast<double>(index) / static_cast<double>(objects);
        share_end_ = static_cast<double>(index + 1) / static_cast<double>(objects);
    }

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
            write_(piece_.data(), static_cast<std::size_t>(end - piece_.data()));
            const double fraction =
                from + (until - from) * static_cast<double>(last) / static_cast<double>(count);
            internal::report_progress(progress_, share_begin_ + (share_end_ - share_begin_) * fraction);
        }
    }

  private:
    const Write write_;
    const Progress progress_;  // a copy: a SurfaceWriter outlives its options
    double share_begin_ = 0, share_end_ = 1;
    std::vector<char> piece_;
};

/// A whole mesh as the only part of its surface.
inline SurfacePart whole(const Mesh& mesh) {
    return {0, mesh.points, mesh.normals, 0, mesh.triangles};
}

using MeshObjects = std::span<const MeshObject>;

void write_obj(MeshOutput& output, MeshObjects objects);
void write_vtp(MeshOutput& output, MeshObjects objects);
void write_glb(MeshOutput& output, MeshObjects objects);
/// The model part of a 3MF file, which is a ZIP archive.
void write_3mf_model(MeshOutput& output, MeshObjects objects);
inline constexpr char k3mfModelName[] = "3D/3dmodel.model";
/// Its other parts.
struct ZipPart {
    const char* name;
    const char* text;
};
std::span<const ZipPart> parts_of_3mf();

/// A name as UTF-8 without control characters: what is not so becomes U+FFFD.
std::string clean_name(const std::string& name);

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
