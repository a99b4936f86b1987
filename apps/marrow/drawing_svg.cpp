// Writes drawings as SVG.
#include <fmt/format.h>

#include "drawing.h"

namespace marrow::apps {
namespace {

std::string element(const Area& area) {
    return fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#{:06x}\"/>\n", area.x,
        area.y, area.width, area.height, area.colour);
}

std::string element(const Line& line) {
    std::string points;
    for (const auto& [x, y] : line.points) points += fmt::format("{:.1f},{:.1f} ", x, y);
    return fmt::format("<polyline fill=\"none\" stroke-width=\"{}\" stroke=\"#{:06x}\" points=\"{}\"/>\n",
                       line.width, line.colour, points);
}

std::string element(const Words& words) {
    const char* const anchor = words.anchor == Words::Anchor::start    ? "start"
                               : words.anchor == Words::Anchor::middle ? "middle"
                                                                       : "end";
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#{:06x}\" text-anchor=\"{}\">{}</text>\n",
                       words.x, words.y, words.colour, anchor, words.text);
}

}  // namespace

std::string svg_of(const Drawing& drawing) {
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"{2}\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"white\"/>\n",
        drawing.width, drawing.height, Drawing::kFontSize);
    for (const auto& shape : drawing.shapes)
        svg += std::visit([](const auto& s) { return element(s); }, shape);
    return svg + "</svg>\n";
}

}  // namespace marrow::apps
