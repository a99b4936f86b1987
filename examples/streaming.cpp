// Extracts the surface of a scan that is larger than memory: it is read and written slab by slab.
//
//     example_streaming SCAN ISOVALUE MESH
//
// SCAN is an uncompressed NRRD, MetaImage or NIfTI file. MESH ends in .stl or .ply.
#include <marrow/marrow.h>

#include <cstdio>
#include <stdexcept>
#include <string>

int main(int argc, char** argv) try {
    if (argc != 4) throw marrow::InputError("usage: example_streaming SCAN ISOVALUE MESH");

    const marrow::SliceSource slices = marrow::open_slices(argv[1]);
    marrow::SurfaceWriter writer(argv[3]);
    const marrow::SlabLimits limits{.memory = std::size_t{256} << 20};  // bytes
    marrow::extract_isosurface_in_slabs(slices, std::stod(argv[2]), writer.sink(), limits, {.closed = true});
    writer.commit();  // the file appears only now, complete

    std::printf("wrote %s\n", argv[3]);
} catch (const std::invalid_argument&) {  // from std::stod
    std::fprintf(stderr, "ISOVALUE is not a number\n");
    return 1;
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
