#include "sweep.h"

#include <algorithm>
#include <cmath>

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

// How far the step to a sample moves the surface.
double shift_to(std::size_t sample, const std::vector<SweepSample>& sweep) {
    return sample == 0 ? 0 : surface_shift(sweep[sample - 1], sweep[sample]);
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
        text += fmt::format("{},{:.3f},{:.3f},{},{},{:.5f},{}\n", s.isovalue, s.volume, s.area, s.components,
                            s.triangles, shift_to(i, sweep), plateau > 0 ? fmt::format("{}", plateau) : "");
    }
    return text;
}

std::string sweep_json(const std::vector<SweepSample>& sweep, const std::vector<Plateau>& plateaus) {
    nlohmann::ordered_json json;
    json["sweep"] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < sweep.size(); ++i) {
        const SweepSample& s = sweep[i];
        json["sweep"].push_back({{"isovalue", s.isovalue},
                                 {"volume_mm3", s.volume},
                                 {"area_mm2", s.area},
                                 {"components", s.components},
                                 {"triangles", s.triangles},
                                 {"shift_mm", shift_to(i, sweep)}});
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
        svg += fmt::format("<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">{2:.4g}</text>\n", kLeft - 6,
                           top + 10, most);
        svg += fmt::format("<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">0</text>\n", kLeft - 6, bottom);
        for (int tick = 0; tick <= 4; ++tick) {
            const double isovalue = from + (to - from) * tick / 4;
            svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.5g}</text>\n",
                               x_of(isovalue), bottom + 16, isovalue);
        }
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
               "least</text>\n</svg>\n",
               kLeft + kWidth / 2, height + 2);
}

}  // namespace marrow
