// Paints slices and handles mouse and keys.
#include "slice_view.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QWheelEvent>

#include "scene_parts.h"

namespace marrow::viewer {
namespace {

const char* plane_name(Plane plane) {
    return plane == Plane::axial ? "Axial" : plane == Plane::coronal ? "Coronal" : "Sagittal";
}

}  // namespace

SliceView::SliceView(Session& session, Surfaces& surfaces, Plane plane, QWidget* parent)
    : QWidget(parent), session_(session), surfaces_(surfaces), plane_(plane) {
    setFocusPolicy(Qt::StrongFocus);
    setMinimumSize(140, 110);
    setCursor(Qt::CrossCursor);
    setMouseTracking(true);
    connect(&session_, &Session::scan_changed, this, &SliceView::follow_scan);
    connect(&session_, &Session::crosshair_changed, this, &SliceView::follow_crosshair);
    connect(&session_, &Session::parameters_changed, this, &SliceView::follow_parameters);
    connect(&session_, &Session::picking_changed, this, [this] { update(); });
    connect(&surfaces_, &Surfaces::shape_changed, this, [this] {
        if (session_.parameters().refined()) follow_parameters();
    });
}

void SliceView::follow_scan() {
    slice_ = slice_geometry(session_.scan()->volume.geometry(), plane_);
    number_ = -1;
    reset_view();
    follow_crosshair();
}

std::int64_t SliceView::slice_number() const {
    return std::llround(session_.crosshair()[static_cast<std::size_t>(slice_.through)]);
}

void SliceView::follow_crosshair() {
    if (!session_.scan()) return;
    if (slice_number() != number_) {
        number_ = slice_number();
        samples_ = slice_samples(session_.scan()->volume, slice_, number_);
        contours_.clear();
        redraw_samples();
        follow_parameters();
    }
    update();
}

void SliceView::follow_parameters() {
    if (!session_.scan() || samples_.empty()) return;
    const Parameters& p = session_.parameters();
    if (!(p.window == window_)) redraw_samples();
    std::vector<Contour> contours;
    const SampleBox box = session_.crop();
    for (const SurfaceParameters& surface : p.surfaces) {
        if (!surface.visible) continue;
        Contour contour{surface.id, surface.isovalue, p.crop, !p.open, {}, {}};
        if (p.refined()) contour.shape = surfaces_.shape(surface.id);
        const auto known = std::find_if(contours_.begin(), contours_.end(),
                                        [&](const Contour& c) { return c.same_source(contour); });
        if (known != contours_.end())
            contour.lines = known->lines;
        else if (!p.refined())
            contour.lines = slice_contour(samples_, slice_.size, slice_range(slice_, box, number_),
                                          surface.isovalue, contour.closed);
        else if (contour.shape)
            contour.lines =
                slice_mesh(*contour.shape->mesh, session_.scan()->volume.geometry(), box, slice_, number_);
        contours.push_back(std::move(contour));
    }
    contours_ = std::move(contours);
    update();
}

void SliceView::redraw_samples() {
    window_ = session_.parameters().window;
    image_ =
        QImage(static_cast<int>(slice_.size[0]), static_cast<int>(slice_.size[1]), QImage::Format_Grayscale8);
    const double black = window_.centre - window_.width / 2, scale = 255 / std::max(window_.width, 1e-12);
    const float* from = samples_.data();
    for (int y = 0; y < image_.height(); ++y) {
        uchar* to = image_.scanLine(y);
        for (int x = 0; x < image_.width(); ++x, ++from)
            to[x] = static_cast<uchar>(std::isfinite(*from) ? std::clamp((*from - black) * scale, 0.0, 255.0)
                                                            : 0);
    }
    update();
}

QVector<QLineF> SliceView::contour_of(int id) const {
    for (const Contour& contour : contours_) {
        if (contour.id == id) return contour.lines;
    }
    return {};
}

void SliceView::reset_view() {
    zoom_ = 1;
    pan_ = {};
    update();
}

// Maps samples to pixels of the widget.
QTransform SliceView::to_widget() const {
    const double wide = static_cast<double>(slice_.size[0]) * slice_.pixel.width();
    const double high = static_cast<double>(slice_.size[1]) * slice_.pixel.height();
    const double scale = zoom_ * std::min((width() - 8) / wide, (height() - 8) / high);
    QTransform transform;
    transform.translate(width() / 2.0 + pan_.x(), height() / 2.0 + pan_.y());
    transform.scale(scale * slice_.pixel.width(), scale * slice_.pixel.height());
    transform.translate(-static_cast<double>(slice_.size[0] - 1) / 2,
                        -static_cast<double>(slice_.size[1] - 1) / 2);
    return transform;
}

QPointF SliceView::widget_point(const Vec3d& index) const {
    return to_widget().map(slice_.to_slice(index));
}

Vec3d SliceView::index_at(const QPointF& point) const {
    return slice_.to_index(to_widget().inverted().map(point), session_.crosshair());
}

void SliceView::paintEvent(QPaintEvent*) {
    QPainter painter(this);
    painter.fillRect(rect(), Qt::black);
    if (!session_.scan() || samples_.empty()) return;
    const QTransform transform = to_widget();
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    // Samples are points, but pixels have an area: the image extends half a sample beyond the outer samples.
    painter.drawImage(transform.mapRect(QRectF(-0.5, -0.5, image_.width(), image_.height())), image_);

    painter.setRenderHint(QPainter::Antialiasing);
    paint_contours(painter, transform);
    paint_crop(painter);
    paint_crosshair(painter, transform);
    paint_marks(painter, transform);
    paint_texts(painter);
}

void SliceView::paint_contours(QPainter& painter, const QTransform& transform) {
    for (const Contour& contour : contours_) {
        const SurfaceParameters* surface = session_.parameters().find(contour.id);
        if (!surface) continue;
        const bool current = surface->id == session_.parameters().current;
        QVector<QLineF> lines = contour.lines;
        for (QLineF& line : lines) line = transform.map(line);
        painter.setPen(QPen(surface->colour, current ? 1.6 : 1.1));
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
    painter.setRenderHint(QPainter::Antialiasing, false);
    painter.setPen(pen(others[0]));
    painter.drawLine(QPointF(at.x(), 0), QPointF(at.x(), at.y() - kGap));
    painter.drawLine(QPointF(at.x(), at.y() + kGap), QPointF(at.x(), height()));
    painter.setPen(pen(others[1]));
    painter.drawLine(QPointF(0, at.y()), QPointF(at.x() - kGap, at.y()));
    painter.drawLine(QPointF(at.x() + kGap, at.y()), QPointF(width(), at.y()));

    painter.setRenderHint(QPainter::Antialiasing);
}

// Dims everything outside the box. The crop tool also shows its border.
void SliceView::paint_crop(QPainter& painter) {
    if (session_.parameters().crop) {
        QPainterPath outside, inside;
        outside.addRect(rect());
        if (!slice_range(slice_, session_.crop(), number_).empty()) inside.addRect(crop_border());
        painter.fillPath(outside.subtracted(inside), QColor(0, 0, 0, 150));
    }
    if (session_.tool() != Tool::crop) return;
    const QRectF border = crop_border();
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(kCropColour, 1.6));
    painter.drawRect(border);
    painter.setBrush(kCropColour);
    painter.setPen(Qt::NoPen);
    const QPointF middle = border.center();
    for (const QPointF& handle : {QPointF(border.left(), middle.y()), QPointF(border.right(), middle.y()),
                                  QPointF(middle.x(), border.top()), QPointF(middle.x(), border.bottom())})
        painter.drawEllipse(handle, 4.5, 4.5);
}

// The crop box in the widget, even if the slice does not meet it.
QRectF SliceView::crop_border() const {
    const SampleBox box = session_.crop();
    Vec3d first, last;
    for (std::size_t a = 0; a < 3; ++a) {
        first[a] = border_of(box, {a, false});
        last[a] = border_of(box, {a, true});
    }
    return QRectF(widget_point(first), widget_point(last)).normalized();
}

std::vector<CropSide> SliceView::crop_sides_at(const QPointF& point) const {
    std::vector<CropSide> sides;
    if (!session_.scan() || session_.tool() != Tool::crop) return sides;
    constexpr double kReach = 7;  // pixels
    const QRectF border = crop_border();
    if (!border.adjusted(-kReach, -kReach, kReach, kReach).contains(point)) return sides;
    const auto add_nearer = [&](double at, double lower, double upper, int axis, bool flipped) {
        const double to_lower = std::abs(at - lower), to_upper = std::abs(at - upper);
        if (std::min(to_lower, to_upper) <= kReach)
            sides.push_back({static_cast<std::size_t>(axis), (to_upper < to_lower) != flipped});
    };
    add_nearer(point.x(), border.left(), border.right(), slice_.across, slice_.across_flipped);
    add_nearer(point.y(), border.top(), border.bottom(), slice_.down, slice_.down_flipped);
    return sides;
}

void SliceView::update_cursor(const QPointF& point) {
    const std::vector<CropSide> sides = crop_sides_at(point);
    const auto across = static_cast<std::size_t>(slice_.across);
    setCursor(sides.empty()                  ? Qt::CrossCursor
              : sides.size() > 1             ? Qt::SizeAllCursor
              : sides.front().axis == across ? Qt::SizeHorCursor
                                             : Qt::SizeVerCursor);
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

double SliceView::value_at_crosshair() const {
    const QPointF point = slice_.to_slice(session_.crosshair());
    const auto u = std::clamp<std::int64_t>(std::llround(point.x()), 0, slice_.size[0] - 1);
    const auto v = std::clamp<std::int64_t>(std::llround(point.y()), 0, slice_.size[1] - 1);
    return samples_[static_cast<std::size_t>(v * slice_.size[0] + u)];
}

void SliceView::paint_texts(QPainter& painter) {
    const QRectF area = QRectF(rect()).adjusted(8, 5, -8, -5);
    const auto write = [&](int flags, const QString& text, const QColor& colour) {
        QRectF shadow = area.translated(1, 1);
        painter.setPen(QColor(0, 0, 0, 220));
        painter.drawText(shadow, flags, text);
        painter.setPen(colour);
        painter.drawText(area, flags, text);
    };
    QFont small = font();
    small.setPixelSize(11);
    painter.setFont(small);
    const QColor faint(205, 212, 220);
    // The position of the slice along the nearest patient axis.
    const Vec3d p = session_.crosshair_position();
    const std::size_t axis = plane_ == Plane::axial ? 2 : plane_ == Plane::coronal ? 1 : 0;
    const char* side = plane_ == Plane::axial     ? (p[2] < 0 ? "I" : "S")
                       : plane_ == Plane::coronal ? (p[1] < 0 ? "A" : "P")
                                                  : (p[0] < 0 ? "R" : "L");
    write(Qt::AlignTop | Qt::AlignRight, QString("%1 %2 mm").arg(side).arg(std::abs(p[axis]), 0, 'f', 1),
          faint);
    const std::int64_t slices =
        session_.scan()->volume.geometry().dims[static_cast<std::size_t>(slice_.through)];
    write(Qt::AlignBottom | Qt::AlignRight, QString("%1 / %2").arg(number_ + 1).arg(slices), faint);
    write(Qt::AlignBottom | Qt::AlignLeft,
          QString::number(value_at_crosshair(), 'g', 6) + (session_.scan()->hounsfield ? " HU" : ""), faint);

    QFont bold = small;
    bold.setBold(true);
    painter.setFont(bold);
    write(Qt::AlignTop | Qt::AlignLeft, tr(plane_name(plane_)), plane_colour(plane_));
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

void SliceView::mousePressEvent(QMouseEvent* event) {
    if (!session_.scan()) return;
    last_ = event->localPos();
    dragging_ = event->button() == Qt::LeftButton && event->modifiers() & Qt::ShiftModifier ? Qt::MiddleButton
                                                                                            : event->button();
    if (dragging_ == Qt::LeftButton) {
        dragged_sides_ = crop_sides_at(last_);
        dragged_sides_.empty() ? press(last_) : session_.end_step();
    }
}

// Sets the crosshair or picks a position to measure.
void SliceView::press(const QPointF& point) {
    Vec3d index = index_at(point);
    if (navigates()) return session_.set_crosshair(index);
    const Geometry& geometry = session_.scan()->volume.geometry();
    for (std::size_t a = 0; a < 3; ++a) {
        const bool inside = index[a] >= -0.5 && index[a] <= static_cast<double>(geometry.dims[a]) - 0.5;
        if (!inside) return;
    }
    // The crosshair may be between two slices, but the position must be on the displayed one.
    index[static_cast<std::size_t>(slice_.through)] = static_cast<double>(number_);
    session_.click(geometry.physical(index));
}

void SliceView::mouseMoveEvent(QMouseEvent* event) {
    if (!session_.scan()) return;
    if (dragging_ == Qt::NoButton) return update_cursor(event->localPos());
    const QPointF moved = event->localPos() - last_;
    last_ = event->localPos();
    if (dragging_ == Qt::LeftButton && !dragged_sides_.empty()) {
        const Vec3d index = index_at(last_);
        for (const CropSide& side : dragged_sides_)
            session_.move_crop_side(side, index[side.axis] + (side.upper ? -0.5 : 0.5));
    } else if (dragging_ == Qt::LeftButton && navigates()) {
        session_.set_crosshair(index_at(last_));
    } else if (dragging_ == Qt::MiddleButton) {
        pan_ += moved;
        update();
    } else if (dragging_ == Qt::RightButton) {
        session_.change(tr("window"), "window", [&](Parameters& p) {
            p.window.width = std::max(p.window.width * std::exp(moved.x() / 150), 1e-6);
            p.window.centre += moved.y() / 300 * p.window.width;
        });
    }
}

void SliceView::mouseReleaseEvent(QMouseEvent*) {
    if (dragging_ == Qt::RightButton || !dragged_sides_.empty()) session_.end_step();
    if (!dragged_sides_.empty()) surfaces_.settle();
    dragged_sides_.clear();
    dragging_ = Qt::NoButton;
}

void SliceView::wheelEvent(QWheelEvent* event) {
    const double steps = event->angleDelta().y() / 120.0;
    if (event->modifiers() & Qt::ControlModifier) {
        const double before = zoom_;
        zoom_ = std::clamp(zoom_ * std::pow(1.2, steps), 0.2, 40.0);
        // Zoom about the mouse position.
        const QPointF mouse = event->position() - QPointF(width() / 2.0, height() / 2.0);
        pan_ = mouse - (mouse - pan_) * (zoom_ / before);
        update();
    } else {
        go(steps > 0 ? std::ceil(steps) : std::floor(steps));
    }
    event->accept();
}

void SliceView::keyPressEvent(QKeyEvent* event) {
    switch (event->key()) {
        case Qt::Key_Up:
        case Qt::Key_Right:
            return go(1);
        case Qt::Key_Down:
        case Qt::Key_Left:
            return go(-1);
        case Qt::Key_PageUp:
            return go(10);
        case Qt::Key_PageDown:
            return go(-10);
        default:
            QWidget::keyPressEvent(event);
    }
}

// Positive steps lead towards superior, posterior or left.
void SliceView::go(double slices) {
    if (!session_.scan()) return;
    Vec3d index = session_.crosshair();
    const auto axis = static_cast<std::size_t>(slice_.through);
    const std::size_t patient = plane_ == Plane::axial ? 2 : plane_ == Plane::coronal ? 1 : 0;
    const bool against = session_.scan()->volume.geometry().direction[patient][axis] < 0;
    index[axis] = std::round(index[axis]) + (against ? -slices : slices);
    session_.set_crosshair(index);
}

}  // namespace marrow::viewer
