// Gives Qt the texts of numbers that both programs share.
#include "number_text.h"

#include "shared/decimal_text.h"
#include "shared/sample_text.h"

namespace marrow::viewer {

QString value_text(double value) {
    return QString::fromStdString(apps::value_text(value));
}

QString decimal_text(double number, int decimals) {
    return QString::fromStdString(apps::decimal_text(number, decimals));
}

}  // namespace marrow::viewer
