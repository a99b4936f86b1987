// Extracts the bone of a CT scan and writes it as a mesh.
//
//     example_extract SCAN MESH
//
// SCAN is a DICOM folder or a NIfTI, NRRD, MetaImage or TIFF file. The ending of MESH picks its format.
#include <marrow/marrow.h>

#include <cstdio>
#include <string>

int main(int argc, char** argv) try {
    if (argc != 3) throw marrow::InputError("usage: example_extract SCAN MESH");

    marrow::ScanInfo info;
    const marrow::Volume scan = marrow::read_scan(argv[1], {}, &info);
    for (const std::string& warning : info.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());

    const double isovalue = marrow::find_preset("bone")->isovalue();  // 225.5 HU
    const marrow::Mesh bone = marrow::extract_isosurface(scan, isovalue, {.closed = true});
    marrow::write_mesh(bone, argv[2]);

    const marrow::MeshMeasures measures = marrow::measure(bone);
    std::printf("%zu triangles enclose %.1f mL\n", bone.triangles.size(), measures.volume / 1000);
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
