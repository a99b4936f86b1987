#include "sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace marrow {
namespace {

// The number of the plateau that a sample lies on, from 1; 0: none.
std::size_t plateau_of(std::size_t sample, const std::vector<Plateau>& plateaus) {
    for (std::size_t p = 0; p < plateaus.size(); ++p) {
        if (plateaus[p].first <= sample && sample <= plateaus[p].last) return p + 1;
    }
    return 0;
}

// How far the step to a sample moves the surface; there is none to the first.
std::optional<double> shift_to(std::size_t sample, const std::vector<SweepSample>& sweep) {
    if (sample == 0) return {};
    return surface_shift(sweep[sample - 1], sweep[sample]);
}

// Round numbers, 1, 2 or 5 times a power of ten apart, and how many decimals they have.
struct Ticks {
    std::vector<double> at;
    int decimals;

    std::string text(double tick) const { return fmt::format("{:.{}f}", tick, decimals); }
};

// About `count` of them from one number to another, both of them included where they are round.
Ticks round_ticks(double from, double to, double count) {
    const double least = (to - from) / count, power = std::pow(10, std::floor(std::log10(least)));
    double step = 10 * power;
    for (const double round : {5.0, 2.0, 1.0}) {
        if (round * power >= least * (1 - 1e-9)) step = round * power;
    }
    if (!std::isfinite(step) || !(step > 0)) return {{}, 0};
    Ticks ticks{{}, std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 20)};
    const double first = std::ceil(from / step - 1e-9), last = std::floor(to / step + 1e-9);
    // Between numbers so near to each other that nothing lies between, there are none.
    for (int n = 0; first + n <= last && n <= 2 * count; ++n)
        ticks.at.push_back((first + n) * step + 0.0);  // no -0
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

constexpr double kLeft = 80, kWidth = 640, kTop = 30, kHeight = 110, kGap = 40;

}  // namespace

std::string sweep_csv(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    std::string text = "isovalue,volume_mm3,area_mm2,components,triangles,shift_mm,plateau\n";
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        const std::size_t plateau = plateau_of(i, plateaus);
        const std::optional<double> shift = shift_to(i, sweep);
        text += fmt::format("{},{:.3f},{:.3f},{},{},{},{}\n", s.isovalue, s.volume, s.area, s.components,
                            s.triangles, shift ? fmt::format("{:.5f}", *shift) : "",
                            plateau > 0 ? fmt::format("{}", plateau) : "");
    }
    return text;
}

std::string sweep_json(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    nlohmann::ordered_json json;
    json["sweep"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        const std::optional<double> shift = shift_to(i, sweep);
        json["sweep"].push_back(
            {{"isovalue", s.isovalue},
             {"volume_mm3", s.volume},
             {"area_mm2", s.area},
             {"components", s.components},
             {"triangles", s.triangles},
             {"shift_mm", shift ? nlohmann::ordered_json(*shift) : nlohmann::ordered_json()}});
    }
    json["plateaus"] = nlohmann::ordered_json::array();
    for (const Plateau& p : plateaus)
        json["plateaus"].push_back({{"from", sweep[p.first].isovalue}, {"to", sweep[p.last].isovalue}});
    return json.dump(2) + '\n';
}

std::string sweep_svg(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    const double from = sweep.front().isovalue, to = sweep.back().isovalue;
    const auto x_of = [&](double isovalue) { return kLeft + kWidth * (isovalue - from) / (to - from); };
    const double height = kTop + static_cast<double>(std::size(kQuantities)) * (kHeight + kGap);
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"12\" fill=\"#333\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"white\"/>\n",
        kLeft + kWidth + 40, height + 10);
    const Ticks isovalues = round_ticks(from, to, 6);
    double top = kTop;
    for (const Quantity& quantity : kQuantities) {
        double most = 0;
        for (const SweepSample& s : sweep) most = std::max(most, quantity.value(s));
        if (most == 0) most = 1;
        const double bottom = top + kHeight;
        for (const Plateau& p : plateaus) {
            const double left = x_of(sweep[p.first].isovalue);
            svg +=
                fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\" fill=\"#f2e3b3\"/>\n",
                            left, top, x_of(sweep[p.last].isovalue) - left, kHeight);
        }
        svg += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"#999\"/>\n", kLeft, top,
                           bottom, kLeft + kWidth);
        svg += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", kLeft, top - 6, quantity.colour,
                           quantity.title);
        const Ticks values = round_ticks(0, most, 4);
        for (const double value : values.at)
            svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", kLeft - 6,
                               bottom - kHeight * value / most + (value == 0 ? 0 : 4), values.text(value));
        for (const double isovalue : isovalues.at)
            svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n",
                               x_of(isovalue), bottom + 16, isovalues.text(isovalue));
        svg += fmt::format("<polyline fill=\"none\" stroke-width=\"2\" stroke=\"{}\" points=\"",
                           quantity.colour);
        for (const SweepSample& s : sweep)
            svg += fmt::format("{:.1f},{:.1f} ", x_of(s.isovalue),
                               bottom - kHeight * std::max(0.0, quantity.value(s)) / most);
        svg += "\"/>\n";
        top = bottom + kGap;
    }
    return svg +
           fmt::format(
               "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">isovalue; shaded: plateaus, where it matters "
               "little</text>\n</svg>\n",
               kLeft + kWidth / 2, height + 2);
}

}  // namespace marrow
