// Extracts many isovalues of one scan quickly, as a viewer does while its user drags a slider.
//
//     example_slider SCAN
#include <marrow/marrow.h>

#include <cstdio>

int main(int argc, char** argv) try {
    if (argc != 2) throw marrow::InputError("usage: example_slider SCAN");
    const marrow::Volume scan = marrow::read_scan(argv[1]);

    // The extractor remembers the range of each block of samples, so the next isovalue reads few of them.
    marrow::IsosurfaceExtractor extractor(scan, {.closed = true});

    // While the slider moves, every fourth sample along each axis (level 2) makes a preview.
    for (const double isovalue : {-300.0, 0.0, 300.0}) {
        const marrow::Mesh& preview = extractor.extract(isovalue, 2);
        std::printf("isovalue %g: preview of %zu triangles\n", isovalue, preview.triangles.size());
    }
    // When it stops, all samples make the surface. It is valid until the next call.
    const marrow::Mesh& surface = extractor.extract(300);
    std::printf("isovalue 300: surface of %zu triangles\n", surface.triangles.size());
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
