// Colours of a trust report.
#include <algorithm>
#include <cmath>

#include <marrow/trust.h>

namespace marrow {
namespace {

using Colour = std::array<std::uint8_t, 3>;

// Light to dark, so that they can be told apart without seeing colours.
constexpr std::array<Colour, 4> kScale{{{224, 224, 224}, {253, 216, 110}, {230, 85, 50}, {120, 0, 30}}};
constexpr Colour kNearWall{30, 90, 200};

}  // namespace

Colour trust_colour(double fraction) {
    const double at = std::clamp(fraction, 0.0, 1.0) * (kScale.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(at), kScale.size() - 2);
    Colour colour{};
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = static_cast<std::uint8_t>(std::lround(std::lerp(static_cast<double>(kScale[below][c]),
                                                                    static_cast<double>(kScale[below + 1][c]),
                                                                    at - static_cast<double>(below))));
    return colour;
}

std::vector<Colour> trust_colours(const TrustReport& report, const std::vector<bool>& near_walls) {
    std::vector<Colour> colours(report.shift.size());
    for (std::size_t i = 0; i < colours.size(); ++i)
        colours[i] =
            i < near_walls.size() && near_walls[i] ? kNearWall : trust_colour(report.shift[i] / report.cap);
    return colours;
}

}  // namespace marrow
