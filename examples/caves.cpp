// Generates ground with overhangs, arches and caves, which a height field cannot hold and marching cubes can.
//
//     example_caves OUT [SAMPLES]
//
// OUT ends in .stl for the mesh, or in .nrrd for the density, whose surface at isovalue 0 is the ground.
// SAMPLES is the number of samples along the longer sides, 192 by default.
//
// The ground is where the density is positive. The density is height(x, y) - z, as of any terrain, plus
// three-dimensional noise that is strong enough to turn cliffs over and to hollow them out.
#include <marrow/marrow.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>

namespace {

// A pseudo-random number in [-1, 1] for each point of the integer lattice.
double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u +
                      static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu +
                      static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
    h = (h ^ (h >> 31)) * 0xBF58476D1CE4E5B9u;
    h = (h ^ (h >> 29)) * 0x94D049BB133111EBu;
    return static_cast<double>(h >> 11) / static_cast<double>(1ull << 52) - 1;
}

// Value noise: the lattice's numbers, smoothly interpolated.
double noise(double x, double y, double z) {
    const double x0 = std::floor(x), y0 = std::floor(y), z0 = std::floor(z);
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    const double u[3] = {smooth(x - x0), smooth(y - y0), smooth(z - z0)};
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
        const double weight = (i ? u[0] : 1 - u[0]) * (j ? u[1] : 1 - u[1]) * (k ? u[2] : 1 - u[2]);
        sum += weight * lattice(static_cast<std::int64_t>(x0) + i, static_cast<std::int64_t>(y0) + j,
                                static_cast<std::int64_t>(z0) + k);
    }
    return sum;
}

// A sum of octaves of noise, each with half the amplitude and twice the frequency of the one before.
double fractal(double x, double y, double z, int octaves) {
    double sum = 0, size = 1;
    for (int octave = 0; octave < octaves; ++octave, size /= 2, x *= 2, y *= 2, z *= 2)
        sum += size * noise(x, y, z + 17 * octave);
    return sum;
}

// The density at a position in metres, over a square of 100 m.
double density(double x, double y, double z) {
    const double hills = 22 + 9 * fractal(x / 40, y / 40, 0.5, 4);
    const double rock = 9 * fractal(x / 16, y / 16, z / 12, 3);
    // A tunnel runs where two noises are both near 0.
    const double a = noise(x / 18 + 40, y / 18, z / 14), b = noise(x / 18, y / 18 + 80, z / 14);
    const double tunnels = 10 * std::exp(-30 * (a * a + b * b));
    const double floor = z < 3 ? 20 * (3 - z) : 0;  // keeps the lowest 3 m solid
    return hills - z + rock - tunnels * 2 + floor;
}

// The fraction of the area, seen from above, that faces downwards. The flat bottom does not count. A height
// field has 0.
double overhanging_fraction(const marrow::Mesh& mesh) {
    double all = 0, hanging = 0, bottom = std::numeric_limits<double>::infinity();
    for (const marrow::Vec3f& p : mesh.points) bottom = std::fmin(bottom, p[2]);
    for (const marrow::Triangle& t : mesh.triangles) {
        const marrow::Vec3f &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
        const double up = (double{b[0]} - a[0]) * (c[1] - a[1]) - (double{b[1]} - a[1]) * (c[0] - a[0]);
        const bool at_bottom = a[2] < bottom + 1 && b[2] < bottom + 1 && c[2] < bottom + 1;
        if (at_bottom) continue;
        all += std::fabs(up);
        if (up < 0) hanging -= up;
    }
    return hanging / all;
}

void write_density(const marrow::Volume& ground, const char* file) {
    const auto& [nx, ny, nz] = ground.geometry().dims;
    const double step = ground.geometry().spacing[0];
    std::ofstream out(file, std::ios::binary);
    out << "NRRD0005\ntype: float\ndimension: 3\nsizes: " << nx << ' ' << ny << ' ' << nz
        << "\nspace: left-posterior-superior\nspace directions: (" << step << ",0,0) (0," << step
        << ",0) (0,0," << step << ")\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n";
    out.write(reinterpret_cast<const char*>(ground.samples<float>()),
              static_cast<std::streamsize>(ground.geometry().sample_count() * 4));
    if (!out.flush()) throw marrow::IoError(std::string("cannot write ") + file);
}

}  // namespace

int main(int argc, char** argv) {
    const std::int64_t n = argc > 2 ? std::atoll(argv[2]) : 192;
    if (argc < 2 || n < 8 || n > 1024) {
        std::fprintf(stderr, "usage: example_caves OUT.stl|OUT.nrrd [SAMPLES from 8 to 1024]\n");
        return 2;
    }
    try {
        marrow::Geometry g;
        g.dims = {n, n, n / 2};
        const double step = 100.0 / static_cast<double>(n);  // metres in the ground, mm in the model
        g.spacing = {step, step, step};
        marrow::Volume ground(g, marrow::SampleType::float32);
        float* sample = ground.samples<float>();
        for (std::int64_t k = 0; k < g.dims[2]; ++k) {
            for (std::int64_t j = 0; j < n; ++j) {
                for (std::int64_t i = 0; i < n; ++i) {
                    const marrow::Vec3d p =
                        g.physical({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
                    *sample++ = static_cast<float>(density(p[0], p[1], p[2]));
                }
            }
        }
        if (std::string_view(argv[1]).ends_with(".nrrd")) {
            write_density(ground, argv[1]);
            return 0;
        }
        // Rocks that float in the air are dropped, and so are caves without a mouth.
        const marrow::Mesh terrain = marrow::keep_components(
            marrow::extract_isosurface(ground, 0, {.closed = true}), {.count = 1, .cavities = false});
        marrow::write_mesh(terrain, argv[1]);
        const marrow::MeshMeasures m = marrow::measure(terrain);
        std::printf("%lld points, %lld triangles, %lld open edges, %lld tunnels, %.0f %% overhanging\n",
                    static_cast<long long>(m.points), static_cast<long long>(m.triangles),
                    static_cast<long long>(m.boundary_edges),
                    static_cast<long long>(1 - m.euler_characteristic / 2),
                    100 * overhanging_fraction(terrain));
    } catch (const marrow::Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
