/// The readers of mesh formats, and what they share.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/mesh.h>
#include <marrow/mesh_io.h>
#include <marrow/progress.h>

#include "base/progress.h"
#include "io/bytes/file_content.h"

namespace marrow::internal::io {

/// \throw InputError that a face names this point, which is missing
[[noreturn]] void refuse_missing_point(const FileContent& input, std::int64_t point);

/// Adds a polygon as a fan of triangles. \throw InputError a corner is not one of `points` points, or there
/// are fewer than three
void add_polygon(const FileContent& input, const std::vector<std::int64_t>& corners, std::size_t points,
                 Mesh& mesh);

/// The point in words 1 to 3 of a line, as in STL and OBJ. \throw InputError
Vec3f parse_point(const FileContent& input, const std::vector<std::string_view>& words);

/// The space that a header or comment states by SPACE=LPS or SPACE=RAS.
Space stated_space(std::string_view text);

/// \throw InputError a coordinate is NaN or infinite
void check_finite(const FileContent& input, std::span<const Vec3f> points);

/// Reports how much of a file is read, once in many calls.
class ReadingProgress {
  public:
    /// `progress` must outlive it.
    explicit ReadingProgress(const Progress& progress) : progress_(progress) {}

    /// \throw Cancelled
    void operator()(double done, double all) {
        constexpr std::uint32_t kCalls = 1 << 14;
        if (++calls_ % kCalls == 0) report_progress(progress_, done / all);
    }

  private:
    const Progress& progress_;
    std::uint32_t calls_ = 0;
};

/// Where an object of a file begins.
struct ObjectStart {
    std::string name;
    std::size_t triangle = 0;  ///< its first one in the mesh
};

/// Each reads a format, with coordinates as in the file. `space` is Space::none and receives the space that
/// the file states. `objects` receives the objects that the file separates, in the order of their triangles.
/// \throw InputError, Cancelled
Mesh read_stl(const FileContent& input, Space& space, const Progress& progress);
Mesh read_ply(const FileContent& input, Space& space, const Progress& progress);
Mesh read_obj(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress);
Mesh read_vtp(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress);
Mesh read_3mf(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress);
/// The coordinates are in millimetres and LPS.
Mesh read_glb(const FileContent& input, Space& space, std::vector<ObjectStart>& objects,
              const Progress& progress);

}  // namespace marrow::internal::io
