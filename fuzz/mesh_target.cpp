// Reads any bytes as a mesh file: read_mesh must return valid triangles or throw an Error. The first byte
// selects the format.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <marrow/error.h>
#include <marrow/mesh_io.h>

#include "input_folder.h"
#include "io/bytes/archive_writer.h"
#include "mesh_kinds.h"

namespace {

namespace fs = std::filesystem;

// The checksums of an archive hide damage from the reader of the model, so this packs a damaged model.
void put_model(const fs::path& path, std::string_view model) {
    constexpr std::string_view kRelations =
        "<Relationships><Relationship Target=\"m\" Type=\"/3dmodel\"/></Relationships>";
    marrow::AtomicFile file(path);
    using marrow::internal::io::ArchiveWriter;
    ArchiveWriter zip(file, ArchiveWriter::Format::zip);
    zip.begin("_rels/.rels");
    zip.write(kRelations.data(), kRelations.size());
    zip.begin("m");
    zip.write(model.data(), model.size());
    zip.finish();
    file.commit();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const InputFolder folder;
    if (size == 0) return 0;
    const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    const std::size_t kind = data[0] % (std::size(kMeshKinds) + 1);
    const bool is_model = kind == std::size(kMeshKinds);
    const fs::path path = folder.path / (std::string("mesh") + (is_model ? ".3mf" : kMeshKinds[kind]));
    is_model ? put_model(path, bytes) : put_file(path, bytes);
    try {
        const marrow::Mesh mesh = marrow::read_mesh(path);
        for (const marrow::Triangle& t : mesh.triangles) {
            for (const std::uint32_t corner : t) {
                if (corner >= mesh.points.size()) std::abort();
            }
        }
    } catch (const marrow::Error&) {
    }
    return 0;
}
