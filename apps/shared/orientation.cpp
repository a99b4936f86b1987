// Names the directions in which index axes run.
#include "orientation.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace marrow::apps {
namespace {

bool is_oblique(const Mat3d& direction) {
    constexpr double kStraight = 0.999;  // 2.6 degrees
    for (std::size_t axis = 0; axis < 3; ++axis) {
        double most = 0;
        for (std::size_t row = 0; row < 3; ++row) most = std::max(most, std::abs(direction[row][axis]));
        if (most < kStraight) return true;
    }
    return false;
}

}  // namespace

std::size_t main_direction(const Mat3d& direction, std::size_t axis) {
    std::size_t main = 0;
    for (std::size_t row = 1; row < 3; ++row) {
        if (std::abs(direction[row][axis]) > std::abs(direction[main][axis])) main = row;
    }
    return main;
}

std::string_view direction_name(const Mat3d& direction, std::size_t axis) {
    constexpr std::string_view kNames[3][2] = {
        {"left", "right"}, {"posterior", "anterior"}, {"superior", "inferior"}};
    const std::size_t main = main_direction(direction, axis);
    return kNames[main][direction[main][axis] < 0];
}

std::string plane_name(const Mat3d& direction) {
    const std::string_view across = direction_name(direction, 2);
    const char* plane = across == "left" || across == "right"           ? "sagittal"
                        : across == "posterior" || across == "anterior" ? "coronal"
                                                                        : "axial";
    return fmt::format("{}{}", is_oblique(direction) ? "oblique, nearly " : "", plane);
}

}  // namespace marrow::apps
