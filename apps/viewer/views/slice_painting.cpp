// Paints slices, and what lies over their samples.
#include <algorithm>
#include <array>
#include <cmath>

#include <QPainter>
#include <QPainterPath>

#include "model/number_text.h"
#include "scene_parts.h"
#include "slice_view.h"

namespace marrow::viewer {
namespace {

const char* plane_name(Plane plane) {
    return plane == Plane::axial ? "Axial" : plane == Plane::coronal ? "Coronal" : "Sagittal";
}

}  // namespace

void SliceView::paintEvent(QPaintEvent*) {
    QPainter painter(this);
    painter.fillRect(rect(), Qt::black);
    if (!session_.scan() || samples_.empty()) return;
    const QTransform transform = to_widget();
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    // Samples are points, but pixels have an area: the image extends half a sample beyond the outer samples.
    painter.setTransform(transform);
    painter.drawImage(QRectF(-0.5, -0.5, image_.width(), image_.height()), image_);
    painter.resetTransform();

    painter.setRenderHint(QPainter::Antialiasing);
    paint_contours(painter, transform);
    paint_crop(painter);
    paint_crosshair(painter, transform);
    paint_marks(painter, transform);
    paint_texts(painter);
}

void SliceView::paint_contours(QPainter& painter, const QTransform& transform) {
    // Where samples are small on the screen, lines are thin, so that they do not fill thin bone.
    const double sample = std::sqrt(std::abs(transform.determinant()));
    const double width = std::clamp(0.5 * sample, 0.4, 1.6);
    for (const Contour& contour : contours_) {
        const SurfaceParameters* surface = session_.parameters().find(contour.id);
        if (!surface) continue;
        const bool current = surface->id == session_.parameters().current;
        QVector<QLineF> lines = contour.lines;
        for (QLineF& line : lines) line = transform.map(line);
        painter.setPen(QPen(surface->colour, current ? width : 0.7 * width));
        painter.drawLines(lines);
    }
}

// Each line has the colour of the plane that it represents. The centre stays free.
void SliceView::paint_crosshair(QPainter& painter, const QTransform& transform) {
    const QPointF at = transform.map(slice_.to_slice(session_.crosshair()));
    const std::array<Plane, 2> others = plane_ == Plane::axial ? std::array{Plane::sagittal, Plane::coronal}
                                        : plane_ == Plane::coronal ? std::array{Plane::sagittal, Plane::axial}
                                                                   : std::array{Plane::coronal, Plane::axial};
    constexpr double kGap = 7;
    const auto pen = [](Plane plane) {
        QColor colour = plane_colour(plane);
        colour.setAlpha(200);
        return QPen(colour, 1);
    };
    // From the gap to beyond the widget, along the samples.
    const double far = std::hypot(width(), height()) + QLineF(at, QPointF(0, 0)).length();
    const auto draw = [&](const QPointF& samples) {
        const QLineF step(QPointF(0, 0), transform.map(samples) - transform.map(QPointF(0, 0)));
        const QPointF along = step.p2() / step.length();
        for (const double side : {-1.0, 1.0})
            painter.drawLine(at + side * kGap * along, at + side * far * along);
    };
    painter.setRenderHint(QPainter::Antialiasing, transform.type() > QTransform::TxScale);
    painter.setPen(pen(others[0]));
    draw({0, 1});
    painter.setPen(pen(others[1]));
    draw({1, 0});
    painter.setRenderHint(QPainter::Antialiasing);
}

// Dims everything outside the box. The crop tool also shows its border.
void SliceView::paint_crop(QPainter& painter) {
    if (session_.parameters().crop) {
        QPainterPath outside, inside;
        outside.addRect(rect());
        if (!slice_range(slice_, session_.crop(), number_).empty()) {
            inside.addPolygon(crop_border());
            inside.closeSubpath();
        }
        painter.fillPath(outside.subtracted(inside), QColor(0, 0, 0, 150));
    }
    if (session_.tool() != Tool::crop) return;
    const QPolygonF border = crop_border();
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(kCropColour, 1.6));
    painter.drawPolygon(border);
    painter.setBrush(kCropColour);
    painter.setPen(Qt::NoPen);
    for (int i = 0; i < 4; ++i) painter.drawEllipse((border[i] + border[(i + 1) % 4]) / 2, 4.5, 4.5);
}

// Measurements in this slice are bright, all others are faint.
void SliceView::paint_marks(QPainter& painter, const QTransform& transform) {
    const Geometry& geometry = session_.scan()->volume.geometry();
    const auto mark = [&](const std::vector<Vec3d>& points, const QString& text) {
        QPolygonF line;
        bool in_slice = true;
        for (const Vec3d& p : points) {
            const Vec3d index = index_of(geometry, p);
            line << transform.map(slice_.to_slice(index));
            const double height =
                index[static_cast<std::size_t>(slice_.through)] - static_cast<double>(number_);
            in_slice = in_slice && std::abs(height) < 1;
        }
        QColor colour(77, 199, 242, in_slice ? 255 : 90);
        painter.setPen(QPen(colour, 1.8));
        painter.setBrush(Qt::NoBrush);
        painter.drawPolyline(line);
        painter.setBrush(colour);
        for (const QPointF& point : line) painter.drawEllipse(point, 2.5, 2.5);
        if (text.isEmpty() || !in_slice) return;
        const QPointF middle = points.size() == 2 ? (line[0] + line[1]) / 2 : line[1];
        QPainterPath path;
        path.addText(middle + QPointF(8, -6), font(), text);
        painter.strokePath(path, QPen(QColor(0, 0, 0, 200), 3));
        painter.fillPath(path, Qt::white);
    };
    for (const Measurement& measurement : session_.parameters().measurements)
        mark(measurement.points, measurement.text());
    if (!session_.picked().empty()) mark(session_.picked(), {});
}

// Such as "MIP 9.0 mm", which is rounded to whole slices; empty for a single slice.
QString SliceView::slab_text() const {
    if (slab_samples_.empty()) return {};
    const Geometry& geometry = session_.scan()->volume.geometry();
    const double thickness = static_cast<double>(slices_in(slab_, geometry, slice_)) *
                             geometry.spacing[static_cast<std::size_t>(slice_.through)];
    return QString("%1 %2 mm")
        .arg(slab_.mode == Slab::Mode::mean ? tr("mean") : tr("MIP"))
        .arg(decimal_text(thickness, 1));
}

void SliceView::paint_texts(QPainter& painter) {
    const QRectF area = QRectF(rect()).adjusted(8, 5, -8, -5);
    const auto write = [&](int flags, const QString& text, const QColor& colour) {
        painter.setPen(QColor(0, 0, 0, 170));
        for (const QPointF outline : {QPointF(1, 1), QPointF(-1, 1), QPointF(1, -1), QPointF(-1, -1)})
            painter.drawText(area.translated(outline), flags, text);
        painter.setPen(colour);
        painter.drawText(area, flags, text);
    };
    QFont small = font();
    small.setPixelSize(11);
    painter.setFont(small);
    const QColor faint(205, 212, 220);
    // The position of the slice along the nearest patient axis.
    Vec3d index = session_.crosshair();
    index[static_cast<std::size_t>(slice_.through)] = static_cast<double>(number_);
    const Vec3d p = session_.scan()->volume.geometry().physical(index);
    const std::size_t axis = plane_ == Plane::axial ? 2 : plane_ == Plane::coronal ? 1 : 0;
    const char* side = plane_ == Plane::axial     ? (p[2] < 0 ? "I" : "S")
                       : plane_ == Plane::coronal ? (p[1] < 0 ? "A" : "P")
                                                  : (p[0] < 0 ? "R" : "L");
    constexpr int kNarrow = 200;  // pixels; there is no room for the position next to the name
    if (width() >= kNarrow)
        write(Qt::AlignTop | Qt::AlignRight,
              QString("%1 %2 mm").arg(side, decimal_text(std::abs(p[axis]), 1)), faint);
    const std::int64_t slices =
        session_.scan()->volume.geometry().dims[static_cast<std::size_t>(slice_.through)];
    write(Qt::AlignBottom | Qt::AlignRight, QString("%1 / %2").arg(number_ + 1).arg(slices), faint);
    write(Qt::AlignBottom | Qt::AlignLeft, readout(), faint);

    QFont bold = small;
    bold.setBold(true);
    painter.setFont(bold);
    write(Qt::AlignTop | Qt::AlignLeft, tr(plane_name(plane_)) + '\n' + slab_text(), plane_colour(plane_));
    const QColor direction(150, 160, 172);
    write(Qt::AlignVCenter | Qt::AlignLeft, slice_.left, direction);
    write(Qt::AlignVCenter | Qt::AlignRight, slice_.right, direction);
    write(Qt::AlignTop | Qt::AlignHCenter, slice_.top, direction);
    write(Qt::AlignBottom | Qt::AlignHCenter, slice_.bottom, direction);
    if (hasFocus()) {
        QColor edge = plane_colour(plane_);
        edge.setAlpha(170);
        painter.setBrush(Qt::NoBrush);
        painter.setPen(QPen(edge, 1));
        painter.drawRect(QRectF(rect()).adjusted(0.5, 0.5, -0.5, -0.5));
    }
}

}  // namespace marrow::viewer
