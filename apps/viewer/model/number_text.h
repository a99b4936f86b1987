/// Numbers for people to read, as the command line writes them.
#pragma once

#include <QString>

namespace marrow::viewer {

/// A sample or an isovalue: apps::value_text().
QString value_text(double value);

/// A number with this many decimals, or with significant digits if it is small: apps::decimal_text().
QString decimal_text(double number, int decimals);

}  // namespace marrow::viewer
