// Writes sweeps as CSV and draws them.
#include "sweep_report.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "shared/decimal_text.h"

namespace marrow::apps {
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
    Rgb colour;
    double (*value)(const SweepSample&);
};

constexpr Quantity kQuantities[] = {
    {"volume, mL", 0xB5483A, [](const SweepSample& s) { return s.volume / 1000; }},
    {"area, cm2", 0x2F6F9F, [](const SweepSample& s) { return s.area / 100; }},
    {"components", 0x5B8A3C, [](const SweepSample& s) { return static_cast<double>(s.components); }},
    {"triangles", 0x7A5BA8, [](const SweepSample& s) { return static_cast<double>(s.triangles); }},
};

// The layout, in pixels.
constexpr double kLeft = 80, kWidth = 640, kTop = 30, kHeight = 110, kGap = 40;

// The horizontal axis that all charts share.
struct IsovalueAxis {
    double from, to;
    Ticks ticks;

    double x(double isovalue) const {
        // The differences of the largest numbers would overflow.
        const double scale = std::isfinite(kWidth * (to - from)) ? 1 : 0x1p-12;
        return kLeft + kWidth * (isovalue * scale - from * scale) / (to * scale - from * scale);
    }
};

constexpr Rgb kDark = 0x333333, kGrey = 0x999999, kPlateau = 0xF2E3B3;

// Draws the chart of one quantity, with its upper edge at `top`.
void draw_chart(const Quantity& quantity, double top, const IsovalueAxis& axis,
                const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus, Drawing& to) {
    using Anchor = Words::Anchor;
    double most = 0;
    for (const SweepSample& s : sweep) most = std::max(most, quantity.value(s));
    if (most == 0) most = 1;
    const double bottom = top + kHeight;
    for (const Plateau& p : plateaus) {
        const double left = axis.x(sweep[p.first].isovalue);
        to.shapes.push_back(Area{left, top, axis.x(sweep[p.last].isovalue) - left, kHeight, kPlateau});
    }
    to.shapes.push_back(Line{{{kLeft, top}, {kLeft, bottom}, {kLeft + kWidth, bottom}}, 1, kGrey});
    to.shapes.push_back(Words{kLeft, top - 6, Anchor::start, quantity.colour, quantity.title});
    const Ticks values = ticks_between(0, most, 4);
    for (const double value : values.at) {
        const double y = bottom - kHeight * value / most + (value == 0 ? 0 : 4);
        to.shapes.push_back(Words{kLeft - 6, y, Anchor::end, kDark, values.text(value)});
    }
    for (const double isovalue : axis.ticks.at)
        to.shapes.push_back(
            Words{axis.x(isovalue), bottom + 16, Anchor::middle, kDark, axis.ticks.text(isovalue)});
    Line line{{}, 2, quantity.colour};
    for (const SweepSample& s : sweep)
        line.points.push_back(
            {axis.x(s.isovalue), bottom - kHeight * std::max(0.0, quantity.value(s)) / most});
    to.shapes.push_back(std::move(line));
}

}  // namespace

std::string sweep_csv(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    std::string text = "isovalue,volume_mm3,area_mm2,components,triangles,shift_mm,plateau\n";
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        const std::size_t plateau = plateau_of(i, plateaus);
        const std::string shift = i > 0 ? decimal_text(surface_shift(sweep[i - 1], s), 5) : "";
        text += fmt::format("{},{},{},{},{},{},{}\n", s.isovalue, decimal_text(s.volume, 3),
                            decimal_text(s.area, 3), s.components, s.triangles, shift,
                            plateau > 0 ? fmt::format("{}", plateau) : "");
    }
    return text;
}

Drawing sweep_drawing(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    const double from = sweep.front().isovalue, to = sweep.back().isovalue;
    const IsovalueAxis axis{from, to, ticks_between(from, to, 6)};
    const double bottom = kTop + static_cast<double>(std::size(kQuantities)) * (kHeight + kGap);
    Drawing drawing{static_cast<int>(kLeft + kWidth + 40), static_cast<int>(bottom + 10), {}};
    double top = kTop;
    for (const Quantity& quantity : kQuantities) {
        draw_chart(quantity, top, axis, sweep, plateaus, drawing);
        top += kHeight + kGap;
    }
    drawing.shapes.push_back(Words{kLeft + kWidth / 2, bottom + 2, Words::Anchor::middle, kDark,
                                   "isovalue; shaded: plateaus, where it matters little"});
    return drawing;
}

}  // namespace marrow::apps
