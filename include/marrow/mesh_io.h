/// Writing meshes, and reading them back.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/progress.h>
#include <marrow/streaming.h>

namespace marrow {

class AtomicFile;

/// The patient space of written coordinates: x to the Left, y to Posterior, z to Superior; or Right,
/// Anterior, Superior; or none, for what is no patient: then files name no space.
enum class Space { LPS, RAS, none };

/// The formats that are written; see write_mesh.
enum class MeshFormat { stl, ply, obj, vtp, threemf, glb };

struct MeshWriteOptions {
    Space space = Space::LPS;  ///< RAS negates x and y of points and normals; not for .glb
    Progress progress = {};    ///< called while writing
};

/// The format that an ending (in either case) stands for. \throw InputError an unknown ending; the message
/// lists them.
MARROW_EXPORT MeshFormat mesh_format(const std::filesystem::path& output);

/// Whether a format keeps several surfaces apart in one file.
MARROW_EXPORT bool holds_several(MeshFormat format);

/// One surface in a file.
struct MeshObject {
    const Mesh* mesh = nullptr;                        ///< borrowed
    std::string name = {};                             ///< UTF-8; what is not is replaced
    std::optional<std::array<double, 3>> colour = {};  ///< red, green, blue from 0 to 1, sRGB
};

/// Writes a mesh; the ending picks the format. The file appears whole or not at all, and an old one stays
/// until then.
///
/// | ending | format                                    | normals | several, names, colours | says its space by                  |
/// | ------ | ----------------------------------------- | ------- | ----------------------- | ---------------------------------- |
/// | .stl   | binary STL                                | facet   | no                      | `SPACE=LPS UNITS=mm` in its header |
/// | .ply   | binary little-endian PLY, float32         | point   | no                      | the same in a comment              |
/// | .obj   | text OBJ, digits that read back exactly   | point   | objects, names          | the same in a comment              |
/// | .vtp   | VTK XML PolyData, appended raw, float32   | point   | cell arrays             | string array SPACE in field data   |
/// | .3mf   | 3MF core, unit millimetre, exact digits   | no      | objects, names, colours | the same in its Description        |
/// | .glb   | binary glTF 2.0, float32 metres, Y up     | point   | nodes, names, colours   | being glTF: +X left, +Y up, +Z to the front |
///
/// .stl.gz, .ply.gz and .obj.gz are the same compressed by gzip (.3mf is compressed by itself). The `SPACE` mark is the one
/// 3D Slicer reads. Coordinates read back with the same bits from every format but .glb, where they are rounded once, to
/// metres. In .vtp, several surfaces or a colour make the cell arrays `Surface` (counted from 0, in the order of the field
/// data's `Names`) and `Colors` (RGB).
/// \throw InputError an unknown ending, normals that do not match the points, triangles that name none, or RAS for .glb;
/// LimitError more than the format can count (.stl 2^32 - 1 triangles, .glb and .3mf 4 GiB); IoError the system said no;
/// Cancelled.
MARROW_EXPORT void write_mesh(const Mesh& mesh, const std::filesystem::path& output,
                              const MeshWriteOptions& options = {});

/// Writes surfaces into one file. \throw as write_mesh; InputError several for a format that holds one, or none
MARROW_EXPORT void write_meshes(std::span<const MeshObject> objects, const std::filesystem::path& output,
                                const MeshWriteOptions& options = {});

/// Files of surfaces that appear together: none before all of them are complete and on the disk. Each waits
/// beside its place until then, and goes with the set that is not committed.
class MARROW_EXPORT MeshFiles {
  public:
    MeshFiles();
    ~MeshFiles();

    /// Writes a file of the set; one that throws is not in it. \throw as write_meshes
    void write(std::span<const MeshObject> objects, const std::filesystem::path& output,
               const MeshWriteOptions& options = {});
    /// Puts all in their places, one after the other: only a place that refuses a finished file leaves those behind it out.
    /// \throw IoError
    void commit();

  private:
    std::vector<std::unique_ptr<AtomicFile>> files_;
};

/// Reads a mesh from any of these formats, STL, PLY and VTP also in their other encodings; the ending says which.
/// Several surfaces become one mesh, in the order of the file, polygons fans of triangles, without normals. Points
/// come back with the bits that they have in the file; .glb's are turned from metres, rounded once. STL names no
/// points: those of the same coordinates become one, in the order of the file. Of 3MF, what is to be built is read, in
/// its unit and place; of glTF, a scene whose nodes are neither moved nor nested. What a file has beyond that is refused.
///
/// Coordinates are millimetres in LPS: x and y are negated where the file's mark says RAS. `space`, where given,
/// receives what the mark says, for .glb LPS unless it says none; nothing where there is none, and the file is then taken for
/// LPS. \throw InputError an unknown ending, or a file that is not what it should be; IoError; LimitError 2^32 points
MARROW_EXPORT Mesh read_mesh(const std::filesystem::path& input, std::optional<Space>* space = nullptr);

/// Writes a surface part by part, with no more in memory than a part: .stl and .ply, not compressed. The file has the same bytes as
/// write_mesh's of the whole, and appears with commit() or not at all.
class MARROW_EXPORT SurfaceWriter {
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
