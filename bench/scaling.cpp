// marrow-bench-scaling: shows how the time grows with the samples N and the active cells M, as a table and as
// a plot with the fit a N + b M log2 N.
// usage: marrow-bench-scaling OUT.svg RUN.json...      (RUN.json: output of marrow-bench --json)
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <marrow/error.h>

namespace marrow::bench {
namespace {

/// The time of one contender on one volume.
struct Point {
    std::string volume, contender;
    double samples, active_cells, milliseconds;
};

/// milliseconds = a * samples + b * active cells * (log2(samples) or 1)
struct Fit {
    double a = 0, b = 0;
    bool logarithm = true;

    double cells_term(double n, double m) const { return logarithm ? m * std::log2(n) : m; }
    double operator()(double n, double m) const { return a * n + b * cells_term(n, m); }
};

// Least squares of the relative deviations, so that small and large volumes have equal weight.
Fit fit(const std::vector<Point>& points, bool logarithm) {
    Fit f{0, 0, logarithm};
    double uu = 0, uv = 0, vv = 0, u1 = 0, v1 = 0;
    for (const Point& p : points) {
        const double u = p.samples / p.milliseconds,
                     v = f.cells_term(p.samples, p.active_cells) / p.milliseconds;
        uu += u * u, uv += u * v, vv += v * v, u1 += u, v1 += v;
    }
    const double determinant = uu * vv - uv * uv;
    if (!(determinant > 0)) throw InputError("the fit needs volumes of several sizes and surfaces");
    f.a = (u1 * vv - v1 * uv) / determinant;
    f.b = (uu * v1 - uv * u1) / determinant;
    return f;
}

/// The relative deviation of a fit from the measurements.
struct Deviation {
    double typical = 0, largest = 0;  // typical is the root mean square
};

Deviation deviation(const std::vector<Point>& points, const Fit& f) {
    Deviation d;
    for (const Point& p : points) {
        const double relative = std::abs(f(p.samples, p.active_cells) / p.milliseconds - 1);
        d.typical += relative * relative / static_cast<double>(points.size());
        d.largest = std::max(d.largest, relative);
    }
    d.typical = std::sqrt(d.typical);
    return d;
}

std::vector<Point> read_runs(int files, char** names) {
    std::vector<Point> points;
    for (int i = 0; i < files; ++i) {
        std::ifstream in(names[i]);
        if (!in) throw IoError(std::string(names[i]) + ": cannot read this file");
        for (const auto& row : nlohmann::json::parse(in)) {
            if (row.at("memory") != "retained" || row.at("threads") != 1) continue;
            points.push_back({row.at("volume"), row.at("contender"), row.at("samples"),
                              row.at("active_cells"), row.at("ms")});
        }
    }
    return points;
}

std::vector<Point> chosen(const std::vector<Point>& points, std::string_view contender,
                          std::string_view volumes) {
    std::vector<Point> result;
    for (const Point& p : points) {
        if (p.contender == contender && p.volume.starts_with(volumes)) result.push_back(p);
    }
    return result;
}

constexpr const char* kInk = "#24323f";
constexpr const char* kMarrow = "#c96f3b";
constexpr const char* kOther = "#8a97a3";
constexpr double kTop = 44, kSize = 280, kLeast = 0.01, kMost = 10'000;  // pixels; range in ms

/// One of the two plots, both axes logarithmic.
struct Panel {
    double left, from, to;  // the x axis shows `from` to `to`

    double x(double value) const { return left + kSize * std::log(value / from) / std::log(to / from); }
    static double y(double ms) {
        return kTop + kSize * (1 - std::log(ms / kLeast) / std::log(kMost / kLeast));
    }
};

void add_text(std::string& svg, double x, double y, const char* anchor, const char* colour,
              const std::string& text) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\">{}</text>\n", x, y,
                       anchor, colour, text);
}

void add_axes(std::string& svg, const Panel& panel, const std::string& title,
              const std::vector<std::pair<double, std::string>>& ticks) {
    add_text(svg, panel.left, kTop - 16, "start", kInk, title);
    for (double ms = kLeast; ms <= kMost * 1.01; ms *= 10) {
        svg += fmt::format("<path d=\"M{:.1f} {:.1f}h{}\" stroke=\"#e3e6e9\"/>\n", panel.left, Panel::y(ms),
                           kSize);
        add_text(svg, panel.left - 6, Panel::y(ms) + 4, "end", kInk, fmt::format("{:g}", ms));
    }
    for (const auto& [value, label] : ticks) {
        svg += fmt::format("<path d=\"M{:.1f} {:.1f}v5\" stroke=\"{}\"/>\n", panel.x(value), kTop + kSize,
                           kOther);
        add_text(svg, panel.x(value), kTop + kSize + 19, "middle", kInk, label);
    }
    svg += fmt::format("<path d=\"M{:.1f} {:.1f}v{}h{}\" fill=\"none\" stroke=\"{}\"/>\n", panel.left, kTop,
                       kSize, kSize, kOther);
}

void add_line(std::string& svg, const char* colour, const char* dashes,
              const std::vector<std::array<double, 2>>& corners) {
    svg += fmt::format(
        "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"{}\" points=\"",
        colour, dashes);
    for (const auto& [x, y] : corners) svg += fmt::format("{:.1f},{:.1f} ", x, y);
    svg += "\"/>\n";
}

void add_dots(std::string& svg, const char* colour, const Panel& panel, const std::vector<Point>& points,
              double Point::*abscissa) {
    for (const Point& p : points) {
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n",
                           panel.x(p.*abscissa), Panel::y(p.milliseconds), colour);
    }
}

std::string draw(const std::vector<Point>& points, const Fit& f) {
    std::string svg =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 720 380\" width=\"720\" height=\"380\" "
        "font-family=\"sans-serif\" font-size=\"12\" role=\"img\">\n"
        "<title>Time of an extraction against samples and against active cells</title>\n"
        "<rect width=\"720\" height=\"380\" fill=\"#ffffff\"/>\n";

    // Phantoms of growing size, whose surface grows with the volume.
    const Panel by_size{54, 50.0 * 50 * 50, 1000.0 * 1000 * 1000};
    std::vector<std::pair<double, std::string>> ticks;
    for (const double n : {64, 128, 256, 512, 768}) ticks.emplace_back(n * n * n, fmt::format("{:g}³", n));
    add_axes(svg, by_size, "ms against samples N (phantoms)", ticks);
    const std::vector<Point> sizes = chosen(points, "marrow", "phantom-");
    std::vector<std::array<double, 2>> whole, reading;
    for (const Point& p : sizes) {
        whole.push_back({by_size.x(p.samples), Panel::y(f(p.samples, p.active_cells))});
        reading.push_back({by_size.x(p.samples), Panel::y(f.a * p.samples)});
    }
    add_line(svg, kMarrow, "none", whole);
    add_line(svg, kMarrow, "3 4", reading);
    add_dots(svg, kOther, by_size, chosen(points, "flying-edges", "phantom-"), &Point::samples);
    add_dots(svg, kMarrow, by_size, sizes, &Point::samples);

    // Gyroids of one size with ever shorter periods, where only the surface grows.
    const std::vector<Point> surfaces = chosen(points, "marrow", "waves-");
    const double n = surfaces.empty() ? 0 : surfaces.front().samples;
    const Panel by_surface{414, 1e5, 2e7};
    add_axes(svg, by_surface,
             fmt::format("ms against active cells M (gyroids of {:.0f}³ samples)", std::cbrt(n)),
             {{1e5, "10⁵"}, {1e6, "10⁶"}, {1e7, "10⁷"}});
    whole.clear();
    for (double m = by_surface.from; m <= by_surface.to; m *= 1.1)
        whole.push_back({by_surface.x(m), Panel::y(f(n, m))});
    add_line(svg, kMarrow, "none", whole);
    add_line(svg, kMarrow, "3 4",
             {{by_surface.left, Panel::y(f.a * n)}, {by_surface.left + kSize, Panel::y(f.a * n)}});
    add_dots(svg, kOther, by_surface, chosen(points, "flying-edges", "waves-"), &Point::active_cells);
    add_dots(svg, kMarrow, by_surface, surfaces, &Point::active_cells);

    svg += fmt::format("<circle cx=\"60\" cy=\"366\" r=\"3.5\" fill=\"{}\"/>\n", kMarrow);
    add_text(svg, 70, 370, "start", kInk, "Marrow");
    svg += fmt::format("<circle cx=\"136\" cy=\"366\" r=\"3.5\" fill=\"{}\"/>\n", kOther);
    add_text(svg, 146, 370, "start", kInk, "vtkFlyingEdges3D");
    add_line(svg, kMarrow, "none", {{270, 366}, {296, 366}});
    add_text(svg, 302, 370, "start", kInk, "a N + b M log N");
    add_line(svg, kMarrow, "3 4", {{414, 366}, {440, 366}});
    add_text(svg, 446, 370, "start", kInk, "a N alone");
    return svg + "</svg>\n";
}

void print_table(const std::vector<Point>& points, const Fit& f, const Fit& linear) {
    fmt::print(
        "| volume | samples N | active cells M | M / N | ms | fit | ns a sample | Flying Edges, ms | "
        "ratio |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
    const std::vector<Point> rivals = chosen(points, "flying-edges", "");
    for (const Point& p : chosen(points, "marrow", "")) {
        const auto rival =
            std::find_if(rivals.begin(), rivals.end(), [&](const Point& r) { return r.volume == p.volume; });
        fmt::print("| {} | {:.0f} | {:.0f} | {:.2f} % | {:.2f} | {:.2f} | {:.2f} |", p.volume, p.samples,
                   p.active_cells, 100 * p.active_cells / p.samples, p.milliseconds,
                   f(p.samples, p.active_cells), 1e6 * p.milliseconds / p.samples);
        if (rival == rivals.end())
            fmt::print(" - | - |\n");
        else
            fmt::print(" {:.1f} | {:.1f} |\n", rival->milliseconds, rival->milliseconds / p.milliseconds);
    }
    const auto print_fit = [&](const char* formula, const Fit& g, const char* cells) {
        const Deviation d = deviation(chosen(points, "marrow", ""), g);
        fmt::print(
            "- {}: a = {:.3f} ns a sample, b = {:.2f} ns {}; off by {:.0f} % (RMS), at most {:.0f} %.\n",
            formula, 1e6 * g.a, 1e6 * g.b, cells, 100 * d.typical, 100 * d.largest);
    };
    fmt::print("\n");
    print_fit("a N + b M log2 N", f, "an active cell and level");
    print_fit("a N + b M", linear, "an active cell");
}

void run(const std::string& plot, int files, char** names) {
    const std::vector<Point> points = read_runs(files, names);
    const std::vector<Point> marrow = chosen(points, "marrow", "");
    const Fit f = fit(marrow, true);
    print_table(points, f, fit(marrow, false));
    std::ofstream out(plot);
    out << draw(points, f) << std::flush;
    if (!out) throw IoError(plot + ": cannot write this file");
}

}  // namespace
}  // namespace marrow::bench

int main(int argc, char** argv) {
    if (argc < 3) return std::fputs("usage: marrow-bench-scaling OUT.svg RUN.json...\n", stderr), 2;
    try {
        marrow::bench::run(argv[1], argc - 2, argv + 2);
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "marrow-bench-scaling: {}\n", error.what());
        return 3;
    }
}
