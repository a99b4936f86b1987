/// Drawings of lines, areas and words, as SVG or PNG. They need no display.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace marrow::apps {

/// Red, green and blue, as in 0xRRGGBB.
using Rgb = std::uint32_t;

// Lengths are in pixels, from the upper left corner to the right and down.

struct Area {
    double x, y, width, height;
    Rgb colour;
};

struct Line {
    std::vector<std::array<double, 2>> points;
    double width;
    Rgb colour;
};

/// One line of sans-serif text.
struct Words {
    enum class Anchor { start, middle, end };
    double x, y;    ///< the anchor, on the base line
    Anchor anchor;  ///< the part of the text that is there
    Rgb colour;
    std::string text;  ///< UTF-8 without & and <
};

/// On white; later shapes cover earlier ones.
struct Drawing {
    static constexpr int kFontSize = 12;
    int width, height;
    std::vector<std::variant<Area, Line, Words>> shapes;
};

std::string svg_of(const Drawing& drawing);

/// A PNG file with two pixels for each of the drawing along both axes. \throw IoError
std::string png_of(const Drawing& drawing);

}  // namespace marrow::apps
