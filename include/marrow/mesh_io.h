/// Writes meshes to files and reads them back.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <marrow/export.h>
#include <marrow/mesh.h>
#include <marrow/parts.h>
#include <marrow/progress.h>
#include <marrow/streaming.h>

namespace marrow {

class AtomicFile;

/// The space of the coordinates in a file. LPS: x to the patient's left, y to posterior, z to superior. RAS:
/// x to the right, y to anterior, z to superior. none: the mesh is not a patient's, or the file does not
/// state a space.
enum class Space { LPS, RAS, none };

/// The formats of mesh files; write_mesh describes them.
enum class MeshFormat { stl, ply, obj, vtp, threemf, glb, dicom };

/// The format that a file's extension selects; case does not matter.
/// \throw InputError the extension is unknown
MARROW_EXPORT MeshFormat mesh_format(const std::filesystem::path& output);

/// Whether a file of this format can hold several separate surfaces.
MARROW_EXPORT bool holds_several(MeshFormat format);

/// Whether a file of this format has normals of points. The other formats do not store them.
MARROW_EXPORT bool holds_normals(MeshFormat format);

struct MeshWriteOptions {
    Space space = Space::LPS;  ///< RAS negates x and y of points and normals; .glb and .dcm do not support it
    Progress progress = {};    ///< called while writing
    /// For .dcm: the DICOM files of the scan (SeriesInfo::dicom_files), whose frame of reference the object
    /// states.
    std::vector<std::filesystem::path> scan_files = {};
    bool keep_patient = false;  ///< for .dcm: also state patient and study, and refer to the files
};

/// A number for each point of a surface.
struct PointArray {
    std::string name;               ///< ASCII letters, digits and _; not one of x y z nx ny nz Normals
    std::string meaning;            ///< one line, such as the unit; written beside the array
    std::span<const float> values;  ///< borrowed; one per point
};

/// Red, green and blue, sRGB.
using Rgb8 = std::array<std::uint8_t, 3>;

/// One surface of a file.
struct MeshObject {
    KeptMeshView mesh;                                 ///< borrowed
    std::string name = {};                             ///< UTF-8; invalid bytes are replaced
    std::optional<std::array<double, 3>> colour = {};  ///< red, green, blue from 0 to 1, sRGB
    std::vector<PointArray> arrays = {};  ///< for .ply and .vtp; at most 16, of the same names in all objects
    /// Borrowed; one for each point or none; for .glb, instead of `colour`.
    std::span<const Rgb8> point_colours = {};
};

/// Writes a mesh; the extension selects the format. The file appears complete or not at all; until then an
/// older file of that name stays.
///
/// | extension | format                        | normals | several                | stated space            |
/// | --------- | ----------------------------- | ------- | ---------------------- | ----------------------- |
/// | .stl      | binary STL                    | facet   | no                     | in the header           |
/// | .ply      | little-endian PLY             | point   | no                     | in a comment            |
/// | .obj      | text OBJ                      | point   | objects, names         | in a comment            |
/// | .vtp      | VTK XML PolyData, raw         | point   | cell arrays            | in the field data       |
/// | .3mf      | 3MF core, unit millimetre     | no      | objects, names, colour | in Description          |
/// | .glb      | binary glTF 2.0, metres, y up | point   | nodes, names, colour   | glTF: +x left, +z front |
/// | .dcm      | DICOM Encapsulated STL, mm    | facet   | no; name as title      | DICOM: frame of ref.    |
///
/// .stl.gz, .ply.gz and .obj.gz are compressed by gzip. The space is stated as SPACE=LPS or SPACE=RAS, which
/// 3D Slicer reads too. Coordinates are float32 and read back with the same bits, except that .glb rounds
/// them once, to metres. Normals of points that point against their faces are written as
/// turn_normals_outward() would turn them. For several surfaces or a colour, .vtp has the cell arrays
/// `Surface` (index in the field data's `Names`) and `Colors` (RGB). Numbers of points are float32
/// properties in .ply, point arrays in .vtp, and their meanings are comments or the field data's
/// `Meanings`; other formats leave them out. .3mf leaves out triangles with two equal corners.
///
/// \throw InputError the extension is unknown, the normals, arrays or colours do not match the points, a
/// triangle names a missing point, a coordinate is NaN or infinite, no triangle for .3mf or .glb, RAS for
/// .glb or .dcm, or no space for .dcm; OptionError keep_patient without scan_files; LimitError more than the
/// format can hold (.stl: 2^32 - 1 triangles; .3mf: 2^31 - 1 points or triangles of a surface; .glb and
/// .dcm: 4 GiB); IoError; Cancelled
MARROW_EXPORT void write_mesh(MeshView mesh, const std::filesystem::path& output,
                              const MeshWriteOptions& options = {});

/// Writes several surfaces to one file.
/// \throw the errors of write_mesh; InputError there is no surface, or the format does not hold several
MARROW_EXPORT void write_meshes(std::span<const MeshObject> objects, const std::filesystem::path& output,
                                const MeshWriteOptions& options = {});

/// A set of mesh files that appear together. Until commit() each is a temporary file in its target's folder.
/// Without commit() the destructor removes them.
class MARROW_EXPORT MeshFiles {
  public:
    MeshFiles();
    ~MeshFiles();

    /// Adds a file to the set, complete and on the disk. If this throws, the file is not in the set.
    /// \throw the errors of write_meshes
    void write(std::span<const MeshObject> objects, const std::filesystem::path& output,
               const MeshWriteOptions& options = {});
    /// Renames the files to their targets, in order. If a rename fails, the later files do not appear.
    /// \throw IoError
    void commit();

  private:
    std::vector<std::unique_ptr<AtomicFile>> files_;
};

/// Reads a mesh; the extension selects the format. All encodings of STL, PLY and VTP are supported.
/// Coordinates become millimetres in LPS: x and y are negated if the file states RAS.
///
/// Several surfaces become one mesh, in the order of the file; read_meshes() keeps them apart. Polygons
/// become fans of triangles. Normals are not read. Points keep the bits of the file, but .glb is converted
/// from metres and rounded once. STL has no shared points: corners with the same coordinates become one
/// point. Of 3MF, the build items are read, with units, transforms and components, also from several models
/// of the archive, but without modifiers and supports. Of glTF, a scene is read whose nodes have no transform
/// and no children. Other features are an error.
///
/// `space`, if given, receives the space that the file states; Space::none if it states none, which is read
/// as LPS. .glb is LPS, unless its extras state none.
/// \throw InputError the extension is unknown or the file is damaged; IoError; LimitError 2^32 points;
/// Cancelled
MARROW_EXPORT Mesh read_mesh(const std::filesystem::path& input, Space* space = nullptr,
                             const Progress& progress = {});

/// One object of a file.
struct NamedMesh {
    std::string name;  ///< empty if the file gives none
    Mesh mesh;
};

/// Reads the objects of a file as meshes of their own, in the order of the file: the objects of 3MF that its
/// build items place, the nodes of glTF, the objects (o) of OBJ, and the surfaces that write_meshes() puts
/// into .vtp. An item of 3MF that is assembled from components is several meshes, because these are solids
/// of their own that may overlap. Objects without triangles are left out. A file whose objects share points,
/// or do not have them one object after the other, is one mesh, and so is any other file.
/// \throw as read_mesh
MARROW_EXPORT std::vector<NamedMesh> read_meshes(const std::filesystem::path& input, Space* space = nullptr,
                                                 const Progress& progress = {});

/// Writes a surface in parts, with only one part in memory: .stl and .ply, uncompressed. The file has the
/// same bytes as from write_mesh. It appears with commit() or not at all.
class MARROW_EXPORT SurfaceWriter {
  public:
    /// options.progress is not called.
    /// \throw the errors of write_mesh; InputError the format cannot be written in parts
    explicit SurfaceWriter(const std::filesystem::path& output, const MeshWriteOptions& options = {});
    ~SurfaceWriter();

    /// The sink for extract_isosurface_in_slabs. It must not outlive the writer.
    SurfaceSink sink();
    /// Renames the file to its target. \pre the sink received all parts
    void commit();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// A file that several processes write parts of a surface to, as one process describes it to the others.
struct SharedSurfaceFile {
    std::filesystem::path temporary;  ///< the file to write to, which all processes can reach
    MeshFormat format = MeshFormat::ply;
    Space space = Space::LPS;
    bool normals = true;
    SurfaceSize size;  ///< of the whole surface
};

/// Creates and commits a surface file that other processes write: .stl and .ply, uncompressed.
/// When all parts were written, the file has the same bytes as from write_mesh. The file
/// appears with commit() or not at all.
class MARROW_EXPORT SharedSurfaceWriter {
  public:
    /// Creates the temporary file, with its header and its size. options.progress is not called.
    /// \throw the errors of write_mesh; InputError the format cannot be written in parts;
    /// LimitError more than 2^32 - 1 points
    SharedSurfaceWriter(const std::filesystem::path& output, const SurfaceSize& size, bool normals,
                        const MeshWriteOptions& options = {});
    ~SharedSurfaceWriter();

    const SharedSurfaceFile& file() const;
    /// Renames the file to its target. \pre all parts were written
    void commit();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Writes what a part owns to its places in the file. Writing a part again changes nothing. Any
/// number of processes and threads may write different parts at the same time. Parts of whole rows of
/// samples are written in large pieces, and parts that are cut across x row by row. The part is then on
/// the disk. It is changed on the way: move it here.
/// \throw InputError the part lies beyond the surface, or has normals and the file
/// does not, or the reverse; IoError
MARROW_EXPORT void write_part(const SharedSurfaceFile& file, NumberedPart part);

}  // namespace marrow
