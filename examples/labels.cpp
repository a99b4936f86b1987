// Turns a label map into one closed surface for each label, and writes all of them into one file.
//
//     example_labels MAP MESHES
//
// MESHES ends in .3mf, .glb, .obj or .vtp, the formats that hold several surfaces.
#include <marrow/marrow.h>

#include <cstdio>
#include <string>
#include <vector>

int main(int argc, char** argv) try {
    if (argc != 3) throw marrow::InputError("usage: example_labels MAP MESHES");
    const marrow::Volume map = marrow::read_scan(argv[1]);

    // Neighbouring surfaces share their points where they meet, so there is no gap between them.
    const std::vector<marrow::LabelSurface> surfaces = marrow::extract_labels(map);

    std::vector<marrow::MeshObject> objects;
    for (const marrow::LabelSurface& surface : surfaces) {
        objects.push_back({.mesh = surface.mesh,
                           .name = "label " + std::to_string(surface.label),
                           .colour = marrow::default_label_colour(surface.label)});
        std::printf("%s: %.2f mL\n", objects.back().name.c_str(),
                    marrow::measure(surface.mesh).volume / 1000);
    }
    marrow::write_meshes(objects, argv[2]);
} catch (const marrow::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
