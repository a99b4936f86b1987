/// The writers of mesh formats, and what they share: output, space and progress.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <marrow/buffer.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/streaming.h>

#include "base/progress.h"
#include "base/three_corners.h"

namespace marrow::internal::io {

static_assert(std::endian::native == std::endian::little, "binary meshes are written as in memory");

/// The text that states the space of a written mesh.
inline std::string space_mark(Space space) {
    if (space == Space::none) return "UNITS=mm";
    return space == Space::RAS ? "SPACE=RAS UNITS=mm" : "SPACE=LPS UNITS=mm";
}

/// Copies the bytes of a value to `to` and returns the end.
template <class T>
char* put(char* to, const T& value) {
    std::memcpy(to, &value, sizeof value);
    return to + sizeof value;
}

/// Whether the extension of a mesh file is .gz.
bool is_gzipped(const std::filesystem::path& file);

/// The output of a writer: it converts to the space of the file and reports progress.
class MeshOutput {
  public:
    using Write = std::function<void(const void* data, std::size_t bytes)>;

    MeshOutput(Write write, const MeshWriteOptions& options)
        : space(options.space), write_(std::move(write)), progress_(options.progress) {}

    const Space space;

    /// A point or normal in the space of the file.
    Vec3f oriented(const Vec3f& v) const { return space == Space::RAS ? Vec3f{-v[0], -v[1], v[2]} : v; }

    void text(const std::string& text) { write_(text.data(), text.size()); }

    /// From now on, progress from 0 to 1 is that of one object.
    void set_share(std::size_t index, std::size_t objects) {
        share_begin_ = static_cast<double>(index) / static_cast<double>(objects);
        share_end_ = static_cast<double>(index + 1) / static_cast<double>(objects);
    }

    /// Writes items 0 to count - 1 in large blocks. `encode(i, to)` writes at most `MaxBytes` at `to` and
    /// returns the end. Progress goes from `from` to `until`. \throw std::logic_error an item was longer
    template <std::size_t MaxBytes, class Encode>
    void items(std::size_t count, double from, double until, Encode encode) {
        constexpr std::size_t kBlock = (std::size_t{1} << 20) / MaxBytes;
        block_.resize((std::min(kBlock, count) + 1) * MaxBytes);  // room to notice one that is too long
        for (std::size_t first = 0; first < count; first += kBlock) {
            const std::size_t last = std::min(first + kBlock, count);
            char* end = block_.data();
            for (std::size_t i = first; i < last; ++i) {
                char* const item = end;
                end = encode(i, item);
                if (static_cast<std::size_t>(end - item) > MaxBytes)
                    throw std::logic_error("a mesh's item is too long");
            }
            write_(block_.data(), static_cast<std::size_t>(end - block_.data()));
            const double fraction =
                from + (until - from) * static_cast<double>(last) / static_cast<double>(count);
            report_progress(progress_, share_begin_ + (share_end_ - share_begin_) * fraction);
        }
    }

  private:
    const Write write_;
    const Progress progress_;  // a copy, because a SurfaceWriter outlives its options
    double share_begin_ = 0, share_end_ = 1;
    Buffer<char> block_;
};

/// A mesh as the only part of its surface.
inline SurfacePart whole(const MeshView& mesh) {
    return {0, mesh.points, mesh.normals, 0, mesh.triangles};
}

using MeshObjects = std::span<const MeshObject>;

void write_obj(MeshOutput& output, MeshObjects objects);
void write_vtp(MeshOutput& output, MeshObjects objects);
void write_glb(MeshOutput& output, MeshObjects objects);
/// Writes the model of a 3MF file, which is a ZIP archive.
void write_3mf_model(MeshOutput& output, MeshObjects objects);
inline constexpr char k3mfModelName[] = "3D/3dmodel.model";
/// The other files of the archive.
struct ArchiveFile {
    const char* name;
    const char* text;
};
std::span<const ArchiveFile> other_3mf_files();

/// A name as valid UTF-8 without control characters; invalid bytes become U+FFFD.
std::string clean_name(const std::string& name);
/// The name of an object where the file needs one: without a name it is "surface 1", by its number.
std::string name_or_number(MeshObjects objects, std::size_t index);

// STL and PLY have records of a fixed size, so that a surface can be written in parts.

/// \throw InputError the extension is not that of an uncompressed STL or PLY file
void check_writable_in_parts(const std::filesystem::path& output);
void write_stl_header(MeshOutput& output, std::uint64_t triangles);
void write_stl_facets(MeshOutput& output, const SurfacePart& part);
inline constexpr std::uint64_t kStlHeaderBytes = 84, kStlFacetBytes = 50;

inline constexpr std::size_t kMostPointArrays = 16;

/// The header of a PLY file.
std::string ply_header(Space space, std::uint64_t points, bool normals, std::uint64_t triangles,
                       std::span<const PointArray> arrays = {});
void write_ply_points(MeshOutput& output, const SurfacePart& part, std::span<const PointArray> arrays = {});
void write_ply_faces(MeshOutput& output, const SurfacePart& part);
inline constexpr std::uint64_t kPlyFaceBytes = 13;
constexpr std::uint64_t ply_point_bytes(bool normals) {
    return normals ? 24 : 12;
}

}  // namespace marrow::internal::io
