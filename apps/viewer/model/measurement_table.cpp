// Composes the lines of the table.
#include "measurement_table.h"

#include <marrow/atomic_file.h>

namespace marrow::viewer {
namespace {

// With nine digits, a position 100 mm from the origin is exact to a nanometre.
QString text_of(double number) {
    return QString::number(number, 'g', 9);
}

}  // namespace

void write_measurements(const std::vector<Measurement>& measurements, const std::filesystem::path& file) {
    QString text = "number,kind,value,unit,x1,y1,z1,x2,y2,z2,x3,y3,z3\n";
    for (std::size_t i = 0; i < measurements.size(); ++i) {
        const Measurement& m = measurements[i];
        const bool distance = m.points.size() == 2;
        text += QString("%1,%2,%3,%4")
                    .arg(i + 1)
                    .arg(distance ? "distance" : "angle")
                    .arg(text_of(m.value()))
                    .arg(distance ? "mm" : "degrees");
        for (std::size_t point = 0; point < 3; ++point) {
            for (std::size_t a = 0; a < 3; ++a)
                text += "," + (point < m.points.size() ? text_of(m.points[point][a]) : QString());
        }
        text += "\n";
    }
    const QByteArray bytes = text.toUtf8();
    AtomicFile out(file);
    out.write(bytes.constData(), static_cast<std::size_t>(bytes.size()));
    out.commit();
}

}  // namespace marrow::viewer
