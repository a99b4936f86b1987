// Writes mesh files by the writer of their format.
#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <marrow/atomic_file.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>

#include "base/all_finite.h"
#include "io/bytes/archive_writer.h"
#include "io/bytes/text.h"
#include "io/dicom/encapsulated_stl.h"
#include "writer.h"

namespace marrow {

using namespace internal::io;

namespace {

constexpr int kThreads = 1;  // files are written by one thread

MeshOutput::Write into(AtomicFile& file) {
    return [&](const void* data, std::size_t bytes) { file.write(data, bytes); };
}

template <class Refuse>
void check_point_data(const MeshObject& object, const Refuse& refuse) {
    const std::size_t points = object.mesh.points.size();
    if (object.arrays.size() > kMostPointArrays)
        refuse("a surface has more than " + std::to_string(kMostPointArrays) + " arrays");
    std::set<std::string> names{"x", "y", "z", "nx", "ny", "nz", "Normals"};  // of the formats
    for (const PointArray& array : object.arrays) {
        constexpr std::string_view kAllowed =
            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
        if (array.name.empty() || array.name.find_first_not_of(kAllowed) != std::string::npos)
            refuse("the name of an array must be of ASCII letters, digits and _, and one is " +
                   quoted(array.name));
        if (!names.insert(array.name).second)
            refuse("an array is named " + array.name + ", which another array or the format itself uses");
        if (clean_name(array.meaning) != array.meaning)
            refuse("the meaning of the array " + array.name + " is not a line of UTF-8");
        if (array.values.size() != points)
            refuse("the mesh has " + std::to_string(points) + " points but " +
                   std::to_string(array.values.size()) + " values in the array " + array.name);
    }
    if (!object.point_colours.empty() && object.point_colours.size() != points)
        refuse("the mesh has " + std::to_string(points) + " points but " +
               std::to_string(object.point_colours.size()) + " colours of points");
}

void check_objects(MeshObjects objects, MeshFormat format, const std::filesystem::path& output, Space space) {
    const auto refuse = [&](const std::string& reason) {
        throw InputError("cannot write " + quoted(output) + ": " + reason);
    };
    if (objects.empty()) refuse("there is no surface");
    if (objects.size() > 1 && !holds_several(format))
        refuse("this format holds one surface, and there are " + std::to_string(objects.size()) +
               "; write .3mf, .glb, .vtp or .obj");
    if (format == MeshFormat::glb && space == Space::RAS)
        refuse("glTF has its own axes and cannot be in RAS");
    if (format == MeshFormat::dicom && space != Space::LPS)
        refuse("DICOM is in LPS, in the space of a patient");
    const auto same_name = [](const PointArray& a, const PointArray& b) { return a.name == b.name; };
    for (const MeshObject& object : objects) {
        const auto& first = objects.front().arrays;
        if (!std::equal(object.arrays.begin(), object.arrays.end(), first.begin(), first.end(), same_name))
            refuse("its surfaces have arrays of different names");
        const MeshView& mesh = object.mesh;
        if (!mesh.normals.empty() && mesh.normals.size() != mesh.points.size())
            refuse("the mesh has " + std::to_string(mesh.points.size()) + " points but " +
                   std::to_string(mesh.normals.size()) + " normals");
        for (const Triangle& t : mesh.triangles) {
            if (std::max({t[0], t[1], t[2]}) >= mesh.points.size())
                refuse("a triangle of the mesh names a missing point");
        }
        if (!internal::all_finite(mesh.points)) refuse("a coordinate of the mesh is NaN or infinite");
        const bool needs_triangles = format == MeshFormat::glb || format == MeshFormat::threemf;
        if (needs_triangles &&
            std::none_of(mesh.triangles.begin(), mesh.triangles.end(), internal::has_three_corners))
            refuse((object.name.empty() ? "the surface" : quoted(object.name)) +
                   " has no triangles; leave it out, or write .ply, .obj or .vtp");
        check_point_data(object, refuse);
    }
}

// Lets the normals of the mesh point outward. If some of them change, `normals` has those of all points.
void use_outward_normals(MeshView& mesh, std::vector<Vec3f>& normals) {
    if (mesh.normals.empty()) return;
    SurfacePart surface = whole(mesh);
    surface.complete_points = mesh.points.size();
    const std::vector<OutwardNormals::Replacement> replaced = OutwardNormals().add(surface, kThreads);
    if (replaced.empty()) return;
    normals.assign(mesh.normals.begin(), mesh.normals.end());
    for (const auto& [point, normal] : replaced) normals[static_cast<std::size_t>(point)] = normal;
    mesh.normals = normals;
}

// An STL file in a DICOM object.
void write_dicom(MeshOutput& to, const MeshObject& object, const MeshWriteOptions& options) {
    const std::uint64_t bytes = kStlHeaderBytes + kStlFacetBytes * object.mesh.triangles.size();
    if (bytes > 0xfffffffe)
        throw LimitError("a DICOM object holds an STL file of at most 4 GiB, and this mesh needs " +
                         std::to_string(bytes >> 20) + " MiB; write .ply or .vtp");
    const StlWrapping wrapping = wrap_stl({.mesh = object.mesh,
                                           .bytes = static_cast<std::uint32_t>(bytes),
                                           .title = clean_name(object.name),
                                           .scan = options.scan_files,
                                           .keep_patient = options.keep_patient});
    to.text(wrapping.before);
    write_stl_header(to, object.mesh.triangles.size());
    write_stl_facets(to, whole(object.mesh));
    to.text(wrapping.after);
}

void write_content(MeshFormat format, MeshOutput& to, MeshObjects objects, const MeshWriteOptions& options) {
    const MeshView& first = objects.front().mesh;
    const std::span<const PointArray> arrays = objects.front().arrays;
    switch (format) {
        case MeshFormat::stl:
            write_stl_header(to, first.triangles.size());
            write_stl_facets(to, whole(first));
            break;
        case MeshFormat::ply:
            to.text(ply_header(to.space, first.points.size(), !first.normals.empty(), first.triangles.size(),
                               arrays));
            write_ply_points(to, whole(first), arrays);
            write_ply_faces(to, whole(first));
            break;
        case MeshFormat::obj:
            write_obj(to, objects);
            break;
        case MeshFormat::vtp:
            write_vtp(to, objects);
            break;
        case MeshFormat::threemf:
            write_3mf_model(to, objects);
            break;
        case MeshFormat::glb:
            write_glb(to, objects);
            break;
        case MeshFormat::dicom:
            write_dicom(to, objects.front(), options);
            break;
    }
}

// Writes the file: plain, compressed by gzip, or as a ZIP archive for 3MF.
void write_content(MeshFormat format, AtomicFile& file, bool gzipped, MeshObjects objects,
                   const MeshWriteOptions& options) {
    if (!gzipped && format != MeshFormat::threemf) {
        MeshOutput to(into(file), options);
        return write_content(format, to, objects, options);
    }
    ArchiveWriter archive(file, gzipped ? ArchiveWriter::Format::gzip : ArchiveWriter::Format::zip);
    if (!gzipped) {
        for (const auto& [name, text] : other_3mf_files()) {
            archive.begin(name);
            archive.write(text, std::char_traits<char>::length(text));
        }
    }
    archive.begin(gzipped ? "mesh" : k3mfModelName);  // gzip states no name
    MeshOutput to([&](const void* data, std::size_t bytes) { archive.write(data, bytes); }, options);
    write_content(format, to, objects, options);
    archive.finish();
}

}  // namespace

bool internal::io::is_gzipped(const std::filesystem::path& file) {
    return to_lower(file.extension().string()) == ".gz";
}

MeshFormat mesh_format(const std::filesystem::path& output) {
    const bool gzipped = is_gzipped(output);
    const std::string end = to_lower((gzipped ? output.stem() : output).extension().string());
    if (end == ".stl") return MeshFormat::stl;
    if (end == ".ply") return MeshFormat::ply;
    if (end == ".obj") return MeshFormat::obj;
    if (end == ".vtp" && !gzipped) return MeshFormat::vtp;
    if (end == ".3mf" && !gzipped) return MeshFormat::threemf;
    if (end == ".glb" && !gzipped) return MeshFormat::glb;
    if (end == ".dcm" && !gzipped) return MeshFormat::dicom;
    throw InputError("there is no mesh format for " + quoted(output) +
                     ": its extension must be .stl, .ply, .obj (also with .gz), .vtp, .3mf, .glb or .dcm");
}

bool holds_several(MeshFormat format) {
    return format != MeshFormat::stl && format != MeshFormat::ply && format != MeshFormat::dicom;
}

bool holds_normals(MeshFormat format) {
    return format == MeshFormat::ply || format == MeshFormat::obj || format == MeshFormat::vtp ||
           format == MeshFormat::glb;
}

void write_mesh(MeshView mesh, const std::filesystem::path& output, const MeshWriteOptions& options) {
    write_meshes(std::array{MeshObject{mesh}}, output, options);
}

void write_meshes(std::span<const MeshObject> objects, const std::filesystem::path& output,
                  const MeshWriteOptions& options) {
    MeshFiles files;
    files.write(objects, output, options);
    files.commit();
}

MeshFiles::MeshFiles() = default;
MeshFiles::~MeshFiles() = default;

void MeshFiles::write(std::span<const MeshObject> objects, const std::filesystem::path& output,
                      const MeshWriteOptions& options) {
    const MeshFormat format = mesh_format(output);
    check_objects(objects, format, output, options.space);
    std::vector<MeshObject> written(objects.begin(), objects.end());
    std::vector<std::vector<Vec3f>> normals(objects.size());
    if (holds_normals(format)) {
        for (std::size_t i = 0; i < written.size(); ++i) use_outward_normals(written[i].mesh, normals[i]);
    }
    auto file = std::make_unique<AtomicFile>(output);
    write_content(format, *file, is_gzipped(output), written, options);
    file->finish();
    files_.push_back(std::move(file));
}

void MeshFiles::commit() {
    const auto files = std::exchange(files_, {});
    for (const auto& file : files) file->commit();
}

// The layout of a file that is written in parts.
struct SurfaceWriter::State {
    State(const std::filesystem::path& output, const MeshWriteOptions& options)
        : format(mesh_format(output)), file(output), to(into(file), without_progress(options)) {}

    // Each part would report from 0 to 1; those who make the parts report how far they are.
    static MeshWriteOptions without_progress(MeshWriteOptions options) {
        options.progress = {};
        return options;
    }

    MeshFormat format;
    AtomicFile file;
    MeshOutput to;
    bool normals = false;
    OutwardNormals outward;
    std::uint64_t points_begin = 0, faces_begin = 0;

    void begin(std::uint64_t points, std::uint64_t triangles, bool has_normals) {
        normals = has_normals;
        if (format == MeshFormat::stl) return write_stl_header(to, triangles);
        const std::string header = ply_header(to.space, points, normals, triangles);
        to.text(header);
        points_begin = header.size();
        faces_begin = points_begin + points * ply_point_bytes(normals);
    }

    void part(const SurfacePart& p) {
        if (format == MeshFormat::stl) {
            file.seek(kStlHeaderBytes + p.first_triangle * kStlFacetBytes);
            return write_stl_facets(to, p);
        }
        write_points(p);
        if (normals) {
            for (const auto& [point, normal] : outward.add(p, kThreads))
                write_points({.first_point = point,
                              .points = p.points.subspan(static_cast<std::size_t>(point - p.first_point), 1),
                              .normals = {&normal, 1},
                              .triangles = {}});
        }
        file.seek(faces_begin + p.first_triangle * kPlyFaceBytes);
        write_ply_faces(to, p);
    }

    void write_points(const SurfacePart& p) {
        file.seek(points_begin + p.first_point * ply_point_bytes(normals));
        write_ply_points(to, p);
    }
};

void internal::io::check_writable_in_parts(const std::filesystem::path& output) {
    const MeshFormat format = mesh_format(output);
    if ((format == MeshFormat::stl || format == MeshFormat::ply) && !is_gzipped(output)) return;
    throw InputError("cannot write " + quoted(output) +
                     " in parts: its extension must be .stl or .ply; write one of these, or extract the "
                     "surface as a whole");
}

SurfaceWriter::SurfaceWriter(const std::filesystem::path& output, const MeshWriteOptions& options) {
    check_writable_in_parts(output);
    state_ = std::make_unique<State>(output, options);
}

SurfaceWriter::~SurfaceWriter() = default;

SurfaceSink SurfaceWriter::sink() {
    return {[this](std::uint64_t points, std::uint64_t triangles, bool normals) {
                state_->begin(points, triangles, normals);
            },
            [this](const SurfacePart& part) { state_->part(part); },
            state_->format == MeshFormat::ply ? OutwardNormals::kBytesPerPoint : 0};
}

void SurfaceWriter::commit() {
    state_->file.commit();
}

}  // namespace marrow
