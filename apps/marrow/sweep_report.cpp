// Writes sweeps as CSV and draws them as SVG.
#include "sweep_report.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace marrow::cli {
namespace {

// The number, from 1, of the plateau that a sample belongs to; 0: none.
std::size_t plateau_of(std::size_t sample, const std::vector<Plateau>& plateaus) {
    for (std::size_t p = 0; p < plateaus.size(); ++p) {
        if (plateaus[p].first <= sample && sample <= plateaus[p].last) return p + 1;
    }
    return 0;
}

// Tick marks at multiples of 1, 2 or 5 times a power of ten, and the decimals that they need.
struct Ticks {
    std::vector<double> at;
    int decimals;

    std::string text(double tick) const { return fmt::format("{:.{}f}", tick, decimals); }
};

// About `count` ticks between two numbers, including them where they are multiples themselves.
Ticks ticks_between(double from, double to, double count) {
    const double least = (to - from) / count, power = std::pow(10, std::floor(std::log10(least)));
    double step = 10 * power;
    for (const double multiple : {5.0, 2.0, 1.0}) {
        if (multiple * power >= least * (1 - 1e-9)) step = multiple * power;
    }
    if (!std::isfinite(step) || !(step > 0)) return {{}, 0};
    Ticks ticks{{}, std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 20)};
    const double first = std::ceil(from / step - 1e-9), last = std::floor(to / step + 1e-9);
    // The bound on n matters when `from` and `to` are neighbouring floating-point numbers.
    for (int n = 0; first + n <= last && n <= 2 * count; ++n)
        ticks.at.push_back((first + n) * step + 0.0);  // + 0.0 turns -0 into 0
    return ticks;
}

struct Quantity {
    const char* title;
    const char* colour;
    double (*value)(const SweepSample&);
};

constexpr Quantity kQuantities[] = {
    {"volume, mL", "#b5483a", [](const SweepSample& s) { return s.volume / 1000; }},
    {"area, cm²", "#2f6f9f", [](const SweepSample& s) { return s.area / 100; }},
    {"components", "#5b8a3c", [](const SweepSample& s) { return static_cast<double>(s.components); }},
    {"triangles", "#7a5ba8", [](const SweepSample& s) { return static_cast<double>(s.triangles); }},
};

// The layout, in pixels.
constexpr double kLeft = 80, kWidth = 640, kTop = 30, kHeight = 110, kGap = 40;

// The horizontal axis that all charts share.
struct IsovalueAxis {
    double from, to;
    Ticks ticks;

    double x(double isovalue) const { return kLeft + kWidth * (isovalue - from) / (to - from); }
};

// The chart of one quantity, with its upper edge at `top`.
std::string chart(const Quantity& quantity, double top, const IsovalueAxis& axis,
                  const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    double most = 0;
    for (const SweepSample& s : sweep) most = std::max(most, quantity.value(s));
    if (most == 0) most = 1;
    const double bottom = top + kHeight;
    std::string svg;
    for (const Plateau& p : plateaus) {
        const double left = axis.x(sweep[p.first].isovalue);
        svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\" fill=\"#f2e3b3\"/>\n",
                           left, top, axis.x(sweep[p.last].isovalue) - left, kHeight);
    }
    svg += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"#999\"/>\n", kLeft, top, bottom,
                       kLeft + kWidth);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", kLeft, top - 6, quantity.colour,
                       quantity.title);
    const Ticks values = ticks_between(0, most, 4);
    for (const double value : values.at)
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", kLeft - 6,
                           bottom - kHeight * value / most + (value == 0 ? 0 : 4), values.text(value));
    for (const double isovalue : axis.ticks.at)
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                           axis.x(isovalue), bottom + 16, axis.ticks.text(isovalue));
    svg += fmt::format("<polyline fill=\"none\" stroke-width=\"2\" stroke=\"{}\" points=\"", quantity.colour);
    for (const SweepSample& s : sweep)
        svg += fmt::format("{:.1f},{:.1f} ", axis.x(s.isovalue),
                           bottom - kHeight * std::max(0.0, quantity.value(s)) / most);
    return svg + "\"/>\n";
}

}  // namespace

std::string sweep_csv(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    std::string text = "isovalue,volume_mm3,area_mm2,components,triangles,shift_mm,plateau\n";
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        const std::size_t plateau = plateau_of(i, plateaus);
        const std::string shift = i > 0 ? fmt::format("{:.5f}", surface_shift(sweep[i - 1], s)) : "";
        text += fmt::format("{},{:.3f},{:.3f},{},{},{},{}\n", s.isovalue, s.volume, s.area, s.components,
                            s.triangles, shift, plateau > 0 ? fmt::format("{}", plateau) : "");
    }
    return text;
}

std::string sweep_svg(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    const double from = sweep.front().isovalue, to = sweep.back().isovalue;
    const IsovalueAxis axis{from, to, ticks_between(from, to, 6)};
    const double height = kTop + static_cast<double>(std::size(kQuantities)) * (kHeight + kGap);
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"12\" fill=\"#333\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"white\"/>\n",
        kLeft + kWidth + 40, height + 10);
    double top = kTop;
    for (const Quantity& quantity : kQuantities) {
        svg += chart(quantity, top, axis, sweep, plateaus);
        top += kHeight + kGap;
    }
    return svg +
           fmt::format(
               "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">isovalue; shaded: plateaus, where it matters "
               "little</text>\n</svg>\n",
               kLeft + kWidth / 2, height + 2);
}

}  // namespace marrow::cli
