// marrow-accuracy PICTURE.svg: how accurate the surfaces of phantoms of known size are. Scans balls, tubes
// and plates with a blur of 1 mm, in slices and with noise, and prints tables in Markdown (docs/accuracy.md).
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "errors.h"
#include "marrow/drawing.h"
#include "plates.h"

namespace marrow::bench {
namespace {

constexpr double kFwhm = 1, kBlur = kFwhm / 2.3548;  // mm
constexpr double kBone = 1500, kTissue = 40, kAir = -1000, kPreset = 225.5;

Scanner scanner(double background, double slice = 0.5, double noise = 10) {
    return {.spacing = 0.5, .slice = slice, .background = background, .material = kBone, .noise = noise};
}

double half_contrast(double background) {
    return (background + kBone) / 2;
}

struct NamedShape {
    const char* name;
    Shape shape;
};

std::vector<NamedShape> shapes() {
    const Vec3d centre{0.13, -0.21, 0.17}, axis{0.3, 0.4, 1};
    return {{"ball, 20 mm", blurred_ball(centre, 10, kBlur)},
            {"ball, 5 mm", blurred_ball(centre, 2.5, kBlur)},
            {"tube, 10 mm", blurred_tube(centre, axis, 5, kBlur)},
            {"tube, 2 mm", blurred_tube(centre, axis, 1, kBlur)}};
}

std::string text(const SurfaceError& error) {
    return error.is_there ? fmt::format("{:+.2f} ± {:.2f}", error.mean, error.deviation) : "nothing";
}

// One line of a table: the errors of all shapes.
void print_errors(const std::string& name, double isovalue, const Scanner& scanner) {
    fmt::print("| {} |", name);
    for (const auto& [shape_name, shape] : shapes())
        fmt::print(" {} |", text(surface_error(shape, 30, isovalue, scanner)));
    fmt::print("\n");
}

void print_header(const std::string& first) {
    fmt::print("| {} |", first);
    for (const auto& [name, shape] : shapes()) fmt::print(" {} |", name);
    fmt::print("\n| --- | --- | --- | --- | --- |\n");
}

void print_isovalues() {
    fmt::print(
        "Bone of 1500 HU, blur of 1 mm FWHM, samples 0.5 mm apart, noise 10 HU: the signed error in mm, mean "
        "± standard "
        "deviation over the points of the surface, positive outside.\n\n");
    print_header("isovalue");
    for (const double background : {kTissue, kAir}) {
        const char* const place = background == kTissue ? "tissue" : "air";
        for (const double isovalue : {150.0, kPreset, 400.0, half_contrast(background), 1100.0})
            print_errors(fmt::format("{:g} HU, in {}{}", isovalue, place,
                                     isovalue == half_contrast(background) ? " (half contrast)" : ""),
                         isovalue, scanner(background));
    }
}

void print_slices() {
    fmt::print(
        "\nThe same in soft tissue, by the thickness of the slices, which is also their distance:\n\n");
    print_header("slices");
    for (const double isovalue : {kPreset, half_contrast(kTissue)}) {
        for (const double slice : {0.5, 1.0, 2.0, 3.0, 5.0})
            print_errors(fmt::format("{:g} mm, at {:g} HU", slice, isovalue), isovalue,
                         scanner(kTissue, slice));
    }
}

constexpr std::array kThicknesses{0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0};

void print_plates() {
    fmt::print(
        "\nThe thickness in mm that a plate shows, on average over its area; samples 0.5 mm apart, no "
        "noise:\n\n"
        "| true thickness | in tissue, 225.5 HU | in tissue, half contrast | in air, 225.5 HU | in air, half "
        "contrast |\n"
        "| --- | --- | --- | --- | --- |\n");
    for (const double w : kThicknesses) {
        fmt::print("| {:g} |", w);
        for (const double background : {kTissue, kAir}) {
            for (const double isovalue : {kPreset, half_contrast(background)})
                fmt::print(" {:.2f} |", shown_thickness(w, kBlur, isovalue, scanner(background, 0.5, 0)));
        }
        fmt::print("\n");
    }
}

void print_thin_walls() {
    fmt::print(
        "\nA plate of {0:g} x {0:g} mm across a frame of bone, oblique; blur 1 mm FWHM, samples 0.5 x 0.5 x "
        "0.8 mm, 225.5 HU. "
        "`shown`: the part of the plate that is in the surface; `alarm`: the area that is reported, of {1:g} "
        "mm²; "
        "`restored`: the part that is in the surface with `--keep-thin`, and its mean thickness. With a "
        "plate of 0 mm, "
        "or one that shows completely, each alarm is false: the frame has about 2000 mm² of surface and "
        "sharp edges.\n\n"
        "| plate, mm | around it | noise, HU | shown | alarm, mm² | restored | thickness, mm | sound |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n",
        kPlateSide, kPlateSide * kPlateSide);
    for (const double background : {kAir, kTissue}) {
        for (const double noise : {10.0, 40.0}) {
            for (const double w : {0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0}) {
                const PlateResult r = examine_plate(w, kBlur, kPreset, scanner(background, 0.8, noise));
                fmt::print("| {:g} | {} | {:g} | {:.0f} % | {:.0f} | {:.0f} % | {} | {} |\n", w,
                           background == kAir ? "air" : "tissue", noise, 100 * r.shown, r.alarm,
                           100 * r.restored,
                           r.restored > 0 ? fmt::format("{:.2f}", r.restored_thickness) : "",
                           r.sound ? "yes" : "no");
            }
        }
    }
}

// The thickness that a plate shows, against its true one.
apps::Drawing thickness_plot() {
    constexpr double kLeft = 60, kTop = 30, kScale = 90, kMost = 4.25;
    constexpr apps::Rgb kGrey = 0x999999, kBlack = 0x222222;
    const auto x = [](double mm) { return kLeft + kScale * mm; };
    const auto y = [](double mm) { return kTop + kScale * (kMost - mm); };
    apps::Drawing plot{650, 470, {}};
    const auto line = [&](std::vector<std::array<double, 2>> points, apps::Rgb colour, double width) {
        for (auto& p : points) p = {x(p[0]), y(p[1])};
        plot.shapes.push_back(apps::Line{std::move(points), width, colour});
    };
    const auto words = [&](double px, double py, apps::Words::Anchor anchor, apps::Rgb colour,
                           const std::string& text) {
        plot.shapes.push_back(apps::Words{px, py, anchor, colour, text});
    };
    for (int mm = 0; mm <= kMost; ++mm) {
        line({{double(mm), 0}, {double(mm), kMost}}, 0xeeeeee, 1);
        line({{0, double(mm)}, {kMost, double(mm)}}, 0xeeeeee, 1);
        words(x(mm), y(0) + 18, apps::Words::Anchor::middle, kBlack, fmt::format("{}", mm));
        words(x(0) - 8, y(mm) + 4, apps::Words::Anchor::end, kBlack, fmt::format("{}", mm));
    }
    words(x(kMost / 2), y(0) + 38, apps::Words::Anchor::middle, kBlack, "true thickness of a plate, mm");
    words(x(0) - 40, y(kMost) - 6, apps::Words::Anchor::start, kBlack, "shown thickness, mm");
    line({{0, 0}, {kMost, kMost}}, kGrey, 1);
    struct Curve {
        double background, isovalue;
        apps::Rgb colour;
        const char* name;
    };
    const std::array curves{Curve{kTissue, kPreset, 0xc0392b, "in tissue, 225.5 HU"},
                            Curve{kTissue, half_contrast(kTissue), 0xe8a29b, "in tissue, half contrast"},
                            Curve{kAir, kPreset, 0x1f5fa8, "in air, 225.5 HU"},
                            Curve{kAir, half_contrast(kAir), 0x9bbbe0, "in air, half contrast"}};
    double row = kTop + 24;
    for (const Curve& curve : curves) {
        std::vector<std::array<double, 2>> points;
        for (double w = 0.05; w <= 3.001; w += w < 1 ? 0.05 : 0.25)
            points.push_back(
                {w, shown_thickness(w, kBlur, curve.isovalue, scanner(curve.background, 0.5, 0))});
        line(points, curve.colour, 2);
        plot.shapes.push_back(
            apps::Line{{{x(kMost) + 10, row - 4}, {x(kMost) + 30, row - 4}}, 2, curve.colour});
        words(x(kMost) + 36, row, apps::Words::Anchor::start, kBlack, curve.name);
        row += 22;
    }
    return plot;
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    using namespace marrow::bench;
    if (argc != 2) {
        fmt::print(stderr, "usage: marrow-accuracy PICTURE.svg\n");
        return 2;
    }
    print_isovalues();
    print_slices();
    print_plates();
    fmt::print(
        "\n![The thickness that a plate shows, against its true thickness](images/accuracy/plates.svg)\n");
    print_thin_walls();
    const std::string plot = marrow::apps::svg_of(thickness_plot());
    std::ofstream picture(argv[1]);
    picture << plot;
    return picture.good() ? 0 : 1;
}
