// What the mesh readers share.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <marrow/error.h>
#include <marrow/mesh.h>
#include <marrow/mesh_io.h>

#include "io/bytes/file_content.h"

namespace marrow {

/// Adds a polygon as a fan of triangles. \throw InputError a corner that is no point, or fewer than three
void add_polygon(const FileContent& input, const std::vector<std::int64_t>& corners, std::size_t points,
                 Mesh& mesh);

/// The space that a header or comment states by SPACE=LPS or SPACE=RAS.
std::optional<Space> marked_space(std::string_view text);

/// \throw InputError a coordinate that is NaN or infinite
void refuse_non_finite(const FileContent& input, std::span<const Vec3f> points);

Mesh read_ply(const FileContent& input, std::optional<Space>& space);
Mesh read_vtp(const FileContent& input, std::optional<Space>& space);
Mesh read_3mf(const FileContent& input, std::optional<Space>& space);
Mesh read_glb(const FileContent& input, std::optional<Space>& space);

}  // namespace marrow
