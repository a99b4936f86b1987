// Extracts a surface on a GPU, or on the CPU if the GPU cannot do it. Both give the same bytes.
//
//     example_gpu SCAN ISOVALUE DEVICE      DEVICE: auto, gpu, or the number or name of a device
#include <marrow/gpu.h>
#include <marrow/marrow.h>

#include <cstdio>
#include <stdexcept>
#include <string>

int main(int argc, char** argv) try {
    if (argc != 4) throw marrow::InputError("usage: example_gpu SCAN ISOVALUE DEVICE");
    const marrow::Volume scan = marrow::read_scan(argv[1]);
    const auto device = marrow::gpu::choose_device(argv[3]);
    // Extractors keep the scan on the device, so keep them where there is more than one isovalue.
    marrow::gpu::FallbackExtractor extractor(scan, {.closed = true}, device);
    const marrow::Mesh& mesh = extractor.extract(std::stod(argv[2]));
    if (extractor.on_device()) std::printf("on %s: ", marrow::gpu::devices().at(*device).name.c_str());
    std::printf("surface of %zu triangles\n", mesh.triangles.size());
} catch (const std::invalid_argument&) {  // from std::stod
    std::fprintf(stderr, "ISOVALUE is not a number\n");
    return 1;
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
