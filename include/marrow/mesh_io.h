/// Writing meshes, and reading them back.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/slabs.h>

namespace marrow {

/// The patient space of written coordinates: x to the Left, y to Posterior, z to Superior; or Right,
/// Anterior, Superior.
enum class Space { LPS, RAS };

/// The formats that are written; see write_mesh.
enum class MeshFormat { stl, ply, obj, vtp };

struct MeshWriteOptions {
    Space space = Space::LPS;  ///< RAS negates x and y of points and normals
    Progress progress = {};    ///< called while writing
};

/// The format that an ending (in either case) stands for. \throw InputError an unknown ending; the message
/// lists them.
MeshFormat mesh_format(const std::filesystem::path& output);

/// Writes a mesh; the ending picks the format. The file appears whole or not at all, and an old one stays
/// until then.
///
/// | ending | format                                    | normals | says its space by                  |
/// | ------ | ----------------------------------------- | ------- | ---------------------------------- |
/// | .stl   | binary STL                                | facet   | `SPACE=LPS UNITS=mm` in its header |
/// | .ply   | binary little-endian PLY, float32         | point   | the same in a comment              |
/// | .obj   | text OBJ, digits that read back exactly   | point   | the same in a comment              |
/// | .vtp   | VTK XML PolyData, appended raw, float32   | point   | string array SPACE in field data   |
///
/// The `SPACE` mark is the one 3D Slicer reads. Coordinates read back with the same bits from every format.
/// \throw InputError an unknown ending, normals that do not match the points, or triangles that name none;
/// LimitError more triangles than the format can count; IoError the system said no; Cancelled.
void write_mesh(const Mesh& mesh, const std::filesystem::path& output, const MeshWriteOptions& options = {});

/// Whether read_mesh takes files of that ending. \throw as mesh_format
bool can_read_mesh(const std::filesystem::path& input);

/// Reads a mesh: binary and text STL, PLY and VTP, and OBJ; the ending says which. Points come back with the bits
/// that they have in the file, polygons as fans of triangles, without normals. STL names no points: those of the
/// same coordinates become one, in the order of the file.
///
/// Coordinates are millimetres in LPS: x and y are negated where the file's mark says RAS. `space`, where given,
/// receives what the mark says; nothing where there is none, and the file is then taken for LPS. \throw
/// InputError an unknown ending, or a file that is not what it should be; IoError; LimitError 2^32 points
Mesh read_mesh(const std::filesystem::path& input, std::optional<Space>* space = nullptr);

/// Writes a surface part by part, with no more in memory than a part: .stl and .ply. The file has the same bytes as
/// write_mesh's of the whole, and appears with commit() or not at all.
class SurfaceWriter {
  public:
    /// options.progress is not called. \throw as write_mesh; InputError a format that cannot be written in parts
    explicit SurfaceWriter(const std::filesystem::path& output, const MeshWriteOptions& options = {});
    ~SurfaceWriter();

    /// What to hand to extract_isosurface_in_slabs; it must not outlive the writer.
    SurfaceSink sink();
    /// Puts the file in its place. \pre all parts were written
    void commit();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace marrow
