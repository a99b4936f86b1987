// Scans a plate in a frame and looks for it.
#include "plates.h"

#include <marrow/isosurface.h>
#include <marrow/measure.h>
#include <marrow/mesh_check.h>
#include <marrow/thin_walls.h>

namespace marrow::bench {
namespace {

constexpr double kFrame = 4, kFrameHeight = 6, kVolume = 36;  // mm

Mat3d oblique_axes() {
    const Vec3d normal = (1 / std::sqrt(1 + 0.16 + 0.0625)) * Vec3d{0.4, -0.25, 1};
    const Vec3d side = cross(normal, Vec3d{0, 1, 0});
    const Vec3d first = (1 / length(side)) * side, second = cross(normal, first);
    return {Vec3d{first[0], second[0], normal[0]}, Vec3d{first[1], second[1], normal[1]},
            Vec3d{first[2], second[2], normal[2]}};
}

Coverage framed_plate(double thickness, double sigma) {
    const Mat3d axes = oblique_axes();
    const Vec3d centre{0.13, -0.21, 0.17};
    std::vector<Coverage> parts;
    const double half = kPlateSide / 2, middle = half + kFrame / 2;
    const auto add = [&](const Vec3d& at, const Vec3d& size) {
        parts.push_back(blurred_box(centre + axes * at, axes, size, sigma));
    };
    for (const double sign : {-1.0, 1.0}) {
        add({sign * middle, 0, 0}, {kFrame / 2, half + kFrame, kFrameHeight / 2});
        add({0, sign * middle, 0}, {half, kFrame / 2, kFrameHeight / 2});
    }
    if (thickness > 0) add({0, 0, 0}, {half, half, thickness / 2});
    return [parts](const Vec3d& p) {
        double sum = 0;
        for (const Coverage& part : parts) sum += part(p);
        return sum;
    };
}

struct Shown {
    double part = 0, thickness = 0;
};

// Follows lines across the plate, away from the frame.
Shown look_across(const Volume& volume, double isovalue) {
    constexpr double kMargin = 2, kReach = 1.75, kStep = 0.02, kApart = 0.25;
    const Mat3d axes = oblique_axes();
    Shown shown;
    int lines = 0, seen = 0;
    for (double u = -kPlateSide / 2 + kMargin; u <= kPlateSide / 2 - kMargin; u += kApart) {
        for (double v = -kPlateSide / 2 + kMargin; v <= kPlateSide / 2 - kMargin; v += kApart) {
            double inside = 0;
            for (double w = -kReach; w <= kReach; w += kStep)
                inside += interpolate(volume, Vec3d{0.13, -0.21, 0.17} + axes * Vec3d{u, v, w}) >= isovalue
                              ? kStep
                              : 0;
            ++lines;
            seen += inside > 0;
            shown.thickness += inside;
        }
    }
    shown.part = static_cast<double>(seen) / lines;
    shown.thickness = seen > 0 ? shown.thickness / seen : 0;
    return shown;
}

}  // namespace

PlateResult examine_plate(double thickness, double sigma, double isovalue, const Scanner& scanner) {
    const Volume volume = scan(framed_plate(thickness, sigma), kVolume, scanner);
    const IsosurfaceOptions options{.closed = true, .topology = true};
    const Mesh mesh = extract_isosurface(volume, isovalue, options);
    const ThinWalls walls = find_thin_walls(volume, isovalue, mesh);
    const Volume kept = restore_thin_walls(volume, isovalue, walls);
    const Mesh restored = extract_isosurface(kept, isovalue, options);
    const Shown before = look_across(volume, isovalue), after = look_across(kept, isovalue);
    return {.shown = before.part,
            .thickness = before.thickness,
            .alarm = walls.area,
            .restored = after.part,
            .restored_thickness = after.thickness,
            .restored_volume = measure(restored).volume - measure(mesh).volume,
            .sound = check_mesh(restored).is_sound()};
}

}  // namespace marrow::bench
