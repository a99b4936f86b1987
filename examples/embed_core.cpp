// Extracts a surface from samples that the program already has in memory. Only marrow::core is linked.
//
//     example_embed_core
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main() {
    marrow::Geometry grid;
    grid.dims = {64, 64, 64};
    grid.spacing = {0.5, 0.5, 0.5};  // mm

    // A torus whose ring has a radius of 10 mm and whose tube has one of 4 mm; samples are positive inside.
    std::vector<float> samples;
    for (int z = 0; z < 64; ++z) {
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {  // x is the fastest index
                const double from_ring = std::hypot(x - 31.5, y - 31.5) * 0.5 - 10;
                samples.push_back(static_cast<float>(4 - std::hypot(from_ring, (z - 31.5) * 0.5)));
            }
        }
    }
    const marrow::VolumeView volume(samples.data(), grid);  // borrows the samples
    const marrow::Mesh torus = marrow::extract_isosurface(volume, 0);

    const marrow::MeshMeasures measures = marrow::measure(torus);
    std::printf("%zu points, %zu triangles, %.0f mm3, Euler characteristic %lld\n", torus.points.size(),
                torus.triangles.size(), measures.volume,
                static_cast<long long>(measures.euler_characteristic));
}
