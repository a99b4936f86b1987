// marrow-bench-smooth-steps [FILE.nhdr]: how many steps of smoothing thick slices need. Samples shapes whose
// surfaces are known, extracts and smooths them, and prints how far they are from the truth as a Markdown
// table (docs/printing.md). Writes the shapes as one volume if a file is given.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/core.h>

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/smooth.h>
#include <marrow/volume.h>

namespace marrow::bench {
namespace {

// A shape by its signed distance in mm, negative inside.
struct Shape {
    std::string name;
    std::function<double(const Vec3d&)> distance;
};

Shape ball(const std::string& name, const Vec3d& centre, double radius) {
    return {name, [=](const Vec3d& p) { return length(p - centre) - radius; }};
}

// A tube with round ends.
Shape tube(const std::string& name, const Vec3d& from, const Vec3d& to, double radius) {
    return {name, [=](const Vec3d& p) {
                const Vec3d axis = to - from;
                const double along = std::clamp(dot(p - from, axis) / dot(axis, axis), 0.0, 1.0);
                return length(p - from - along * axis) - radius;
            }};
}

Shape ring(const std::string& name, const Vec3d& centre, const Vec3d& axis, double large, double small) {
    return {name, [=](const Vec3d& p) {
                const Vec3d to = p - centre;
                const double height = dot(to, axis) / length(axis);
                const double out = std::sqrt(std::max(0.0, dot(to, to) - height * height)) - large;
                return std::hypot(out, height) - small;
            }};
}

// All apart from each other, in a box of 60 mm.
std::vector<Shape> shapes() {
    return {ball("ball, 24 mm", {16, 16, 30}, 12),
            ring("ring, 7 mm thick", {42, 20, 30}, {0.5, 0, 0.87}, 10, 3.5),
            tube("tube, 5 mm", {8, 38, 12}, {50, 40, 44}, 2.5),
            tube("tube, 3 mm", {8, 50, 22}, {50, 52, 38}, 1.5)};
}

constexpr std::array<std::int64_t, 3> kDims{120, 120, 24};
constexpr Vec3d kSpacing{0.5, 0.5, 2.5};
constexpr float kInside = 1000;

// A sample is the mean over its box, as in a slice that is as thick as the slices are apart.
Volume sampled(const std::vector<Shape>& shapes) {
    Geometry g;
    g.dims = kDims;
    g.spacing = kSpacing;
    Volume volume(g, SampleType::float32);
    float* sample = volume.samples<float>();
    constexpr std::array<int, 3> kParts{3, 3, 15};
    for (std::int64_t z = 0; z < kDims[2]; ++z) {
        for (std::int64_t y = 0; y < kDims[1]; ++y) {
            for (std::int64_t x = 0; x < kDims[0]; ++x) {
                const std::array<std::int64_t, 3> index{x, y, z};
                int inside = 0;
                for (int part = 0; part < kParts[0] * kParts[1] * kParts[2]; ++part) {
                    const std::array<int, 3> at{part % 3, part / 3 % 3, part / 9};
                    Vec3d p{};
                    for (std::size_t a = 0; a < 3; ++a)
                        p[a] =
                            kSpacing[a] * (static_cast<double>(index[a]) - 0.5 + (at[a] + 0.5) / kParts[a]);
                    inside += std::any_of(shapes.begin(), shapes.end(),
                                          [&](const Shape& s) { return s.distance(p) < 0; });
                }
                *sample++ = kInside * static_cast<float>(inside) / (kParts[0] * kParts[1] * kParts[2]);
            }
        }
    }
    return volume;
}

struct Errors {
    double rms = 0;    // mm, over the area
    double angle = 0;  // degrees: the root mean square between the normals of the triangles and the true ones
};

Errors errors_of(const Mesh& mesh, const Shape& shape) {
    Errors sums;
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3d a = to_double(mesh.points[t[0]]), b = to_double(mesh.points[t[1]]),
                    c = to_double(mesh.points[t[2]]);
        const Vec3d centre = (1.0 / 3) * (a + b + c), normal = cross(b - a, c - a);
        Vec3d gradient{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Vec3d step{};
            step[axis] = 1e-4;
            gradient[axis] = shape.distance(centre + step) - shape.distance(centre - step);
        }
        const double size = length(normal), error = shape.distance(centre);
        if (size == 0) continue;
        const double cosine = std::clamp(dot(normal, gradient) / (size * length(gradient)), -1.0, 1.0);
        sums.rms += size * error * error;
        sums.angle += size * std::pow(std::acos(cosine) * 180 / std::numbers::pi, 2);
        area += size;
    }
    return {std::sqrt(sums.rms / area), std::sqrt(sums.angle / area)};
}

void print_table() {
    struct Column {
        Shape shape;
        Mesh mesh;
    };
    std::vector<Column> columns;
    for (const Shape& shape : shapes()) {
        const Volume volume = sampled({shape});
        columns.push_back(
            {shape, extract_isosurface(volume, kInside / 2, {.normals = false, .closed = true})});
    }
    fmt::print("| iterations |");
    for (const Column& c : columns) fmt::print(" {} |", c.shape.name);
    fmt::print("\n| ---------: |");
    for (std::size_t i = 0; i < columns.size(); ++i) fmt::print(" --- |");
    fmt::print("\n");
    for (const int steps : {0, 5, 10, 20, 40, 60, 100}) {
        fmt::print("| {} |", steps);
        for (const Column& c : columns) {
            const Mesh mesh = smooth(c.mesh, {.iterations = steps});
            const Errors errors = errors_of(mesh, c.shape);
            fmt::print(" {:.2f} mm, {:.0f}°, {:+.1f} % |", errors.rms, errors.angle,
                       100 * (measure(mesh).volume / measure(c.mesh).volume - 1));
        }
        fmt::print("\n");
    }
}

void write_nrrd(const std::filesystem::path& file, const Volume& volume) {
    std::filesystem::path raw = file;
    raw.replace_extension(".raw");
    std::ofstream header(file), data(raw, std::ios::binary);
    header << fmt::format(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: {} {} {}\nencoding: raw\nendian: little\n"
        "space: left-posterior-superior\nspace directions: ({},0,0) (0,{},0) (0,0,{})\n"
        "space origin: (0,0,0)\ndata file: {}\n",
        kDims[0], kDims[1], kDims[2], kSpacing[0], kSpacing[1], kSpacing[2], raw.filename().string());
    data.write(reinterpret_cast<const char*>(volume.samples<float>()),
               static_cast<std::streamsize>(sizeof(float) * kDims[0] * kDims[1] * kDims[2]));
    if (!header.flush() || !data.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    using namespace marrow::bench;
    if (argc > 1)
        write_nrrd(argv[1], sampled(shapes()));
    else
        print_table();
}
