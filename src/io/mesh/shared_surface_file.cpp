// Writes surfaces from several processes to one file: one creates it at its size, and each writes its
// records.
#include <algorithm>
#include <cerrno>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <marrow/atomic_file.h>
#include <marrow/error.h>
#include <marrow/mesh_io.h>
#include <marrow/normals.h>

#include "io/bytes/text.h"
#include "writer.h"

namespace marrow {

using namespace internal::io;

namespace {

// The bytes of a file at which its records begin, and where it ends.
struct Layout {
    std::uint64_t points = 0, triangles = 0, end = 0;

    explicit Layout(const SharedSurfaceFile& file) {
        const auto& [point_count, triangle_count] = file.size;
        if (file.format == MeshFormat::stl) {
            triangles = kStlHeaderBytes;
            end = triangles + triangle_count * kStlFacetBytes;
        } else {
            points = ply_header(file.space, point_count, file.normals, triangle_count).size();
            triangles = points + point_count * ply_point_bytes(file.normals);
            end = triangles + triangle_count * kPlyFaceBytes;
        }
    }
};

// A file that exists, written to at chosen places.
class ExistingFile {
  public:
    explicit ExistingFile(const std::filesystem::path& path)
        : path_(path), descriptor_(::open(path.c_str(), O_WRONLY | O_CLOEXEC)) {
        if (descriptor_ < 0) fail();
    }
    ~ExistingFile() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    ExistingFile(const ExistingFile&) = delete;
    ExistingFile& operator=(const ExistingFile&) = delete;

    // Flushes and closes the file: over a network, a full disk may show only then.
    void finish() {
        if (::fsync(descriptor_) != 0) fail();
        if (::close(std::exchange(descriptor_, -1)) != 0) fail();
    }

    void seek(std::uint64_t offset) { offset_ = offset; }
    void write(const void* data, std::size_t bytes) {
        const char* next = static_cast<const char*>(data);
        while (bytes > 0) {
            const ssize_t written = ::pwrite(descriptor_, next, bytes, static_cast<off_t>(offset_));
            if (written < 0) {
                if (errno == EINTR) continue;
                fail();
            }
            next += written;
            offset_ += static_cast<std::uint64_t>(written);
            bytes -= static_cast<std::size_t>(written);
        }
    }

  private:
    [[noreturn]] void fail() const {
        throw IoError("cannot write " + quoted(path_) + ": " + std::generic_category().message(errno));
    }

    const std::filesystem::path path_;
    int descriptor_;
    std::uint64_t offset_ = 0;
};

void check(const SharedSurfaceFile& file, const NumberedPart& part) {
    const auto ends_within = [](const std::vector<NumberedRun>& runs, std::uint64_t size) {
        return std::all_of(runs.begin(), runs.end(),
                           [&](const NumberedRun& run) { return run.number + run.count <= size; });
    };
    if (!ends_within(part.points, file.size.points) || !ends_within(part.triangles, file.size.triangles))
        throw InputError("a part lies beyond the surface of " + quoted(file.temporary));
    if (!part.mesh.points.empty() && part.mesh.normals.empty() == file.normals)
        throw InputError("a part and the file " + quoted(file.temporary) + " do not both have normals");
}

template <class T>
std::span<const T> elements(const Buffer<T>& all, const NumberedRun& run) {
    return std::span(all).subspan(run.begin, run.count);
}

void write_facets(MeshOutput& to, const Mesh& mesh, const NumberedRun& run) {
    write_stl_facets(to, {.points = mesh.points, .normals = {}, .triangles = elements(mesh.triangles, run)});
}

void write_points(MeshOutput& to, const Mesh& mesh, const NumberedRun& run) {
    SurfacePart records{.points = elements(mesh.points, run), .normals = {}, .triangles = {}};
    if (!mesh.normals.empty()) records.normals = elements(mesh.normals, run);
    write_ply_points(to, records);
}

void write_faces(MeshOutput& to, const Mesh& mesh, const NumberedRun& run) {
    write_ply_faces(to, {.points = {}, .normals = {}, .triangles = elements(mesh.triangles, run)});
}

void write_records(const SharedSurfaceFile& file, NumberedPart& part, ExistingFile& existing) {
    const Layout layout(file);
    MeshWriteOptions options;
    options.space = file.space;
    MeshOutput to([&](const void* data, std::size_t bytes) { existing.write(data, bytes); }, options);
    Mesh& mesh = part.mesh;
    if (file.format == MeshFormat::stl) {
        for (const NumberedRun& run : part.triangles) {
            existing.seek(layout.triangles + run.number * kStlFacetBytes);
            write_facets(to, mesh, run);
        }
        return;
    }
    constexpr int kThreads = 1;  // other parts are written at the same time
    turn_normals_outward(mesh, kThreads);
    for (const NumberedRun& run : part.points) {
        existing.seek(layout.points + run.number * ply_point_bytes(file.normals));
        write_points(to, mesh, run);
    }
    for (Triangle& triangle : mesh.triangles) {
        for (std::uint32_t& point : triangle) point = part.numbers[point];
    }
    for (const NumberedRun& run : part.triangles) {
        existing.seek(layout.triangles + run.number * kPlyFaceBytes);
        write_faces(to, mesh, run);
    }
}

}  // namespace

struct SharedSurfaceWriter::State {
    explicit State(const std::filesystem::path& output) : target(output) {}

    AtomicFile target;
    SharedSurfaceFile file;
};

SharedSurfaceWriter::SharedSurfaceWriter(const std::filesystem::path& output, const SurfaceSize& size,
                                         bool normals, const MeshWriteOptions& options) {
    check_writable_in_parts(output);
    if (size.points > std::numeric_limits<std::uint32_t>::max())
        throw LimitError(
            "the surface has " + std::to_string(size.points) +
            " points, more than the 2^32 - 1 that triangles can name; crop or coarsen the volume");
    const MeshFormat format = mesh_format(output);
    state_ = std::make_unique<State>(output);
    AtomicFile& target = state_->target;
    state_->file = {std::filesystem::absolute(target.temporary()), format, options.space, normals, size};
    MeshOutput to([&](const void* data, std::size_t bytes) { target.write(data, bytes); }, options);
    if (format == MeshFormat::stl)
        write_stl_header(to, size.triangles);
    else
        to.text(ply_header(options.space, size.points, normals, size.triangles));
    if (size.triangles == 0) return;
    target.seek(Layout(state_->file).end - 1);
    target.write("", 1);
}

SharedSurfaceWriter::~SharedSurfaceWriter() = default;

const SharedSurfaceFile& SharedSurfaceWriter::file() const {
    return state_->file;
}

void SharedSurfaceWriter::commit() {
    state_->target.commit();
}

void write_part(const SharedSurfaceFile& file, NumberedPart part) {
    check(file, part);
    ExistingFile existing(file.temporary);
    write_records(file, part, existing);
    existing.finish();
}

}  // namespace marrow
