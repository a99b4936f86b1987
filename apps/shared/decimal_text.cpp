// Prints numbers for people to read.
#include "decimal_text.h"

#include <cmath>

#include <fmt/format.h>

namespace marrow::apps {

std::string decimal_text(double number, int decimals) {
    const bool is_small = number != 0 && std::abs(number) < std::pow(10, 1 - decimals);
    return is_small ? fmt::format("{:.4g}", number) : fmt::format("{:.{}f}", number, decimals);
}

}  // namespace marrow::apps
