// Extracts a ball from samples in memory, with marrow::core alone.
#include <marrow/isosurface.h>
#include <marrow/measure.h>

#include <cstdio>
#include <vector>

int main() {
    marrow::Geometry geometry;
    geometry.dims = {32, 32, 32};
    std::vector<float> samples;
    for (int z = 0; z < 32; ++z) {
        for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 32; ++x) {
                const marrow::Vec3d p{x - 15.5, y - 15.5, z - 15.5};
                samples.push_back(static_cast<float>(10 - length(p)));
            }
        }
    }
    const marrow::Mesh ball = extract_isosurface(marrow::VolumeView(samples.data(), geometry), 0);
    const marrow::MeshMeasures measures = measure(ball);
    std::printf("%lld triangles, Euler characteristic %lld\n", static_cast<long long>(measures.triangles),
                static_cast<long long>(measures.euler_characteristic));
    return measures.boundary_edges == 0 && measures.euler_characteristic == 2 ? 0 : 1;
}
