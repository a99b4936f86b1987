// Extracts a surface on a GPU, or on the CPU if the GPU cannot do it. Both give the same bytes.
//
//     example_gpu SCAN ISOVALUE DEVICE
#include <marrow/gpu.h>
#include <marrow/marrow.h>

#include <cstdio>
#include <cstdlib>

namespace {

marrow::Mesh extract(const marrow::Volume& scan, double isovalue, std::size_t device) {
    try {
        // Extractors keep the scan on the device, so keep them where there is more than one isovalue.
        marrow::Mesh mesh;
        marrow::gpu::Extractor(scan, {.closed = true}, device).extract(isovalue, mesh);
        std::printf("on %s: ", marrow::gpu::devices().at(device).name.c_str());
        return mesh;
    } catch (const marrow::gpu::DeviceError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return marrow::extract_isosurface(scan, isovalue, {.closed = true});
    }
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 4) throw marrow::InputError("usage: example_gpu SCAN ISOVALUE DEVICE");
    const marrow::Volume scan = marrow::read_scan(argv[1]);
    const marrow::Mesh mesh = extract(scan, std::atof(argv[2]), std::strtoul(argv[3], nullptr, 10));
    std::printf("surface of %zu triangles\n", mesh.triangles.size());
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
