// Writes seeds for the fuzz targets to FOLDER/<target>/<seed>: the small valid scans of the tests, and a mesh
// in every format.
#include <blosc.h>
#include <lz4.h>
#include <zstd.h>

#include <cstdio>

#include <fmt/format.h>

#include <marrow/mesh_io.h>

#include "mesh_kinds.h"
#include "support/small_scans.h"
#include "support/temporary_folder.h"
#include "zarr_files.h"

using namespace marrow::test;

namespace {

std::string target_of(const fs::path& file) {
    const std::string name = file.string();
    for (const auto& [end, target] :
         {std::pair(".nii", "nifti"), std::pair(".hdr", "nifti"), std::pair(".nrrd", "nrrd"),
          std::pair(".nhdr", "nrrd"), std::pair(".mha", "metaimage"), std::pair(".mhd", "metaimage"),
          std::pair(".png", "picture"), std::pair(".tif", "picture"), std::pair(".jpg", "picture"),
          std::pair(".bmp", "picture")}) {
        if (name.find(end) != name.npos) return target;
    }
    return "dicom";
}

void write_meshes_to(const fs::path& folder) {
    const TemporaryFolder work;
    const marrow::Mesh mesh{
        {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {0, 0, 10}}, {}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
    char kind = 0;
    for (const char* ending : kMeshKinds) {
        const fs::path path = work / (std::string("mesh") + ending);
        marrow::write_mesh(mesh, path);
        write_file(folder / (ending + 1), kind++ + read_file(path));
    }
    write_file(
        folder / "model",
        kind + std::string("<model unit=\"inch\"><resources><object id=\"1\"><mesh><vertices>"
                           "<vertex x=\"1\" y=\"2\" z=\"3\"/><vertex x=\"4\" y=\"5\" z=\"6\"/>"
                           "</vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"1\"/></triangles></mesh>"
                           "</object></resources><build><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 "
                           "7 8 9\"/></build></model>"));
    // Objects that are assembled from others, of this model by its name in the archive.
    write_file(
        folder / "project",
        kind +
            std::string("<model xmlns=\"urn:c\" xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/"
                        "production/2015/06\" requiredextensions=\"p\"><resources><object id=\"1\"><mesh>"
                        "<vertices><vertex x=\"1\" y=\"2\" z=\"3\"/></vertices><triangles><triangle v1=\"0\" "
                        "v2=\"0\" v3=\"0\"/></triangles></mesh></object><object id=\"2\"><components>"
                        "<component p:path=\"/m\" objectid=\"1\"/><component objectid=\"1\" transform=\"-1 0 "
                        "0 0 1 0 0 0 1 7 8 9\"/></components></object></resources><build>"
                        "<item objectid=\"2\"/><item objectid=\"2\"/></build></model>"));
}

// Chunks of 3 x 4 x 5 samples in each compression.
std::string packed(const std::string& name, const std::string& bytes) {
    std::string out(bytes.size() + 1024, '\0');
    std::size_t size = 0;
    if (name == "zlib" || name == "gzip") return deflated(bytes, name == "zlib" ? 15 : 31);
    if (name == "zstd") size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
    if (name == "blosc")
        size = static_cast<std::size_t>(blosc_compress_ctx(5, BLOSC_SHUFFLE, 2, bytes.size(), bytes.data(),
                                                           out.data(), out.size(), "lz4", 0, 1));
    if (name == "lz4")
        size = static_cast<std::size_t>(LZ4_compress_default(
            bytes.data(), out.data(), static_cast<int>(bytes.size()), static_cast<int>(out.size())));
    out.resize(size);
    return name == "lz4" ? bytes_of(static_cast<std::uint32_t>(bytes.size())) + out : out;
}

void write_zarr_seeds(const fs::path& folder) {
    std::vector<std::uint16_t> samples;
    for (int i = 0; i < 60; ++i) samples.push_back(static_cast<std::uint16_t>(i * i % 401));
    const std::string raw = bytes_of(samples);
    const std::string array_2 = R"({"zarr_format":2,"shape":[4,4,5],"chunks":[3,4,5],"dtype":"<u2",)"
                                R"("fill_value":7,"order":"F","filters":null,)";
    write_file(folder / "2-raw",
               zarr_file(".zarray", array_2 + R"("compressor":null})") + zarr_file("0.0.0", raw));
    for (const std::string name : {"zlib", "zstd", "blosc", "lz4"})
        write_file(folder / ("2-" + name),
                   zarr_file(".zarray", array_2 + R"("compressor":{"id":")" + name + "\"}}") +
                       zarr_file("0.0.0", packed(name, raw)));

    const auto array_3 = [](const std::string& shape, const std::string& chunk, const std::string& codecs) {
        return fmt::format(
            R"({{"zarr_format":3,"node_type":"array","shape":[{}],"data_type":"uint16",)"
            R"("fill_value":"0x0007",)"
            R"("chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":[{}]}}}},"codecs":[{}],)"
            R"("chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}}}})",
            shape, chunk, codecs);
    };
    const std::string bytes = R"({"name":"bytes","configuration":{"endian":"little"}})";
    write_file(
        folder / "3-gzip",
        zarr_file("zarr.json", array_3("3,4,9", "3,4,5",
                                       R"({"name":"transpose","configuration":{"order":[1,2,0]}},)" + bytes +
                                           R"(,{"name":"gzip","configuration":{"level":5}})")) +
            zarr_file("c/0/0/0", packed("gzip", raw)) + zarr_file("c/0/0/1", packed("gzip", raw)));
    // An image of OME-Zarr 0.5 with two channels, whose shards have two chunks each; the second is missing.
    const std::string shards =
        R"({"name":"sharding_indexed","configuration":{"chunk_shape":[1,3,4,5],"codecs":[)" + bytes +
        R"(],"index_codecs":[)" + bytes + R"(],"index_location":"start"}})";
    const std::string ome_5 =
        R"({"zarr_format":3,"node_type":"group","attributes":{"ome":{"version":"0.5","multiscales":[)"
        R"({"axes":[)"
        R"({"name":"c","type":"channel"},{"name":"z","type":"space","unit":"micrometer"},)"
        R"({"name":"y","type":"space","unit":"micrometer"},{"name":"x","type":"space","unit":"micrometer"}],)"
        R"("datasets":[{"path":"0","coordinateTransformations":[{"type":"scale","scale":[1,2,3,4]},)"
        R"({"type":"translation","translation":[0,5,6,7]}]}]}],"omero":{"channels":[{"label":"a"}]}}}})";
    write_file(folder / "ome-5",
               zarr_file("zarr.json", ome_5) +
                   zarr_file("0/zarr.json", array_3("2,3,4,9", "1,3,4,10", shards)) +
                   zarr_file("0/c/0/0/0/0",
                             bytes_of(std::vector<std::uint64_t>{32, raw.size(), ~0ull, ~0ull}) + raw));
    const std::string ome_4 =
        R"({"multiscales":[{"version":"0.4","axes":[{"name":"t","type":"time"},{"name":"z","type":"space"},)"
        R"({"name":"y","type":"space"},{"name":"x","type":"space"}],"datasets":[{"path":"0",)"
        R"("coordinateTransformations":[{"type":"scale","scale":[1,0.5,0.25,0.25]}]}]}]})";
    write_file(
        folder / "ome-4",
        zarr_file(".zgroup", R"({"zarr_format":2})") + zarr_file(".zattrs", ome_4) +
            zarr_file("0/.zarray", R"({"zarr_format":2,"shape":[1,3,4,5],"chunks":[1,3,4,5],"dtype":"<u2",)"
                                   R"("fill_value":0,"order":"C","filters":null,"compressor":null})") +
            zarr_file("0/0.0.0.0", raw));
}

std::vector<std::uint16_t> sample_values() {
    std::vector<std::uint16_t> samples;
    for (int i = 0; i < 144; ++i) samples.push_back(static_cast<std::uint16_t>(i * i % 4001));
    return samples;
}

void write_codec_seeds(const fs::path& folder) {
    const std::vector<std::uint16_t> samples = sample_values();
    const std::string head{"\0\x0b\x0b\0", 4};
    const auto codec = [&](char syntax, const std::string& name, const std::string& stream) {
        write_file(folder / "codec" / name, syntax + head.substr(1) + stream);
    };
    codec(0, "jpeg", jpeg_8(12, 12, std::vector<std::uint8_t>(144, 9)));
    codec(1, "jpeg12", flat_jpeg(12, 12, {1, 4000, 0, 900}, 12, false));
    codec(1, "progressive", flat_jpeg(12, 12, {1, 4000, 0, 900}, 12, true));
    codec(2, "lossless", lossless_jpeg(12, 12, samples, 12, 7, true));
    codec(4, "jpegls", jpeg_ls(12, 12, samples, 12));
    codec(5, "j2k", jpeg_2000(12, 12, samples, 12));
    codec(5, "htj2k", htj2k(12, 12, samples, 12));
    std::vector<std::uint16_t> waves;
    for (int i = 0; i < 64 * 48; ++i)
        waves.push_back(static_cast<std::uint16_t>(i % 64 * (i / 64) * 7 % 4001));
    write_file(folder / "codec" / "htj2k_levels",
               std::string{"\x05\x3f\x2f\0", 4} + htj2k(64, 48, waves, 12));
    std::string runs = bytes_of(std::uint32_t{2}) + bytes_of(std::uint32_t{64}) + bytes_of(std::uint32_t{68});
    runs.resize(64);
    codec(6, "rle", runs + "\x81\1\xf1\2\x81\3\xf1\4");
}

void write_extract_seeds(const fs::path& folder) {
    const std::vector<std::uint16_t> samples = sample_values();
    for (const char type : {0, 2, 4, 6, 1, 3, 5, 7})
        write_file(folder / "extract" / std::to_string(type),
                   std::string("\x06\x02\x03") + type + std::string("\x40\x00", 2) + bytes_of(samples));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return std::fputs("usage: make_seeds FOLDER\n", stderr), 2;
    const fs::path folder = argv[1];
    for (const SmallScan& scan : small_scans()) {
        const auto& [name, bytes] = *scan.files.begin();  // the header, or the first slice
        std::string flat = name;
        for (char& c : flat) c = c == '/' ? '-' : c;
        write_file(folder / target_of(scan.name) / flat, bytes);
    }
    write_codec_seeds(folder);
    write_extract_seeds(folder);
    write_meshes_to(folder / "mesh");
    write_zarr_seeds(folder / "zarr");
    return 0;
}
