// Paints slices and handles mouse and keys.
#include "slice_view.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QWheelEvent>

#include "model/number_text.h"
#include "scene_parts.h"
#include "window_presets.h"

namespace marrow::viewer {
namespace {

const char* plane_name(Plane plane) {
    return plane == Plane::axial ? "Axial" : plane == Plane::coronal ? "Coronal" : "Sagittal";
}

}  // namespace

SliceView::SliceView(Session& session, Surfaces& surfaces, Plane plane, QWidget* parent)
    : QWidget(parent),
      session_(session),
      surfaces_(surfaces),
      plane_(plane),
      mark_drag_(session, mark_view()) {
    setFocusPolicy(Qt::StrongFocus);
    setMinimumSize(100, 60);  // so that all fit on a screen of 800 x 500
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
        read_samples();
        contours_.clear();
        redraw_samples();
        follow_parameters();
    }
    update();
}

void SliceView::read_samples() {
    const Volume& volume = session_.scan()->volume;
    samples_ = slice_samples(volume, slice_, number_);
    slab_samples_.clear();
    if (slices_in(slab_, volume.geometry(), slice_) > 1)
        slab_samples_ = slab_samples(volume, slice_, number_, slab_);
}

void SliceView::set_slab(const Slab& slab) {
    slab_ = slab;
    if (!session_.scan()) return;
    read_samples();
    redraw_samples();
}

void SliceView::follow_parameters() {
    if (!session_.scan() || samples_.empty()) return;
    const Parameters& p = session_.parameters();
    if (!(p.window == window_)) redraw_samples();
    std::vector<Contour> contours;
    const SampleBox box = session_.crop();
    for (const SurfaceParameters& surface : p.surfaces) {
        if (!surface.visible) continue;
        Contour contour{surface.id, surface.isovalue, p.crop, !p.open, p.topology, p.refined(), {}, {}};
        if (p.refined()) contour.shape = surfaces_.shape(surface.id);
        const auto known = std::find_if(contours_.begin(), contours_.end(),
                                        [&](const Contour& c) { return c.same_source(contour); });
        if (known != contours_.end())
            contour.lines = known->lines;
        else if (!p.refined())
            contour.lines = slice_contour(samples_, slice_.size, slice_range(slice_, box, number_),
                                          slice_isovalue(session_.scan()->volume, surface.isovalue),
                                          contour.closed, contour.topology);
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
    const float* from = shown().data();
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

double SliceView::fitting_scale() const {
    constexpr double kMargin = 8;
    const QRectF samples(0, 0, static_cast<double>(slice_.size[0]), static_cast<double>(slice_.size[1]));
    const QSizeF mm = slice_.to_mm.mapRect(samples).size();
    return std::min(std::max(1.0, width() - kMargin) / mm.width(),
                    std::max(1.0, height() - kMargin) / mm.height());
}

// Maps samples to pixels of the widget.
QTransform SliceView::to_widget() const {
    const auto columns = static_cast<double>(slice_.size[0]), rows = static_cast<double>(slice_.size[1]);
    const double fit = fitting_scale();
    return QTransform::fromTranslate((1 - columns) / 2, (1 - rows) / 2) * slice_.to_mm *
           QTransform::fromScale(zoom_ * fit, zoom_ * fit) *
           QTransform::fromTranslate(width() / 2.0 + fit * pan_.x(), height() / 2.0 + fit * pan_.y());
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

// The crop box in samples of the slice, even if the slice does not meet it.
QRectF SliceView::crop_rectangle() const {
    const SampleBox box = session_.crop();
    Vec3d first, last;
    for (std::size_t a = 0; a < 3; ++a) {
        first[a] = border_of(box, {a, false});
        last[a] = border_of(box, {a, true});
    }
    return QRectF(slice_.to_slice(first), slice_.to_slice(last)).normalized();
}

// The corners of the crop box in the widget.
QPolygonF SliceView::crop_border() const {
    const QRectF box = crop_rectangle();
    return to_widget().map(QPolygonF({box.topLeft(), box.topRight(), box.bottomRight(), box.bottomLeft()}));
}

std::vector<CropSide> SliceView::crop_sides_at(const QPointF& point) const {
    std::vector<CropSide> sides;
    if (!session_.scan() || session_.tool() != Tool::crop) return sides;
    constexpr double kReach = 7;  // pixels
    const QTransform transform = to_widget();
    const QPointF at = transform.inverted().map(point);
    const QRectF box = crop_rectangle();
    // How far columns and rows of samples are apart in the widget; they need not be perpendicular.
    const double area = std::abs(transform.determinant());
    const double reach_across = kReach * std::hypot(transform.m21(), transform.m22()) / area;
    const double reach_down = kReach * std::hypot(transform.m11(), transform.m12()) / area;
    if (!box.adjusted(-reach_across, -reach_down, reach_across, reach_down).contains(at)) return sides;
    const auto add_nearer = [&](double x, double lower, double upper, double reach, int axis, bool flipped) {
        const double to_lower = std::abs(x - lower), to_upper = std::abs(x - upper);
        if (std::min(to_lower, to_upper) <= reach)
            sides.push_back({static_cast<std::size_t>(axis), (to_upper < to_lower) != flipped});
    };
    add_nearer(at.x(), box.left(), box.right(), reach_across, slice_.across, slice_.across_flipped);
    add_nearer(at.y(), box.top(), box.bottom(), reach_down, slice_.down, slice_.down_flipped);
    return sides;
}

void SliceView::update_cursor(const QPointF& point) {
    const std::vector<CropSide> sides = crop_sides_at(point);
    const auto across = static_cast<std::size_t>(slice_.across);
    setCursor(sides.empty() && mark_drag_.reaches(point.toPoint()) ? Qt::OpenHandCursor
              : sides.empty()                                      ? Qt::CrossCursor
              : sides.size() > 1                                   ? Qt::SizeAllCursor
              : sides.front().axis == across                       ? Qt::SizeHorCursor
                                                                   : Qt::SizeVerCursor);
}

// Ends in this slice can be dragged within it.
MarkView SliceView::mark_view() {
    const auto index = [this](const Vec3d& position) {
        return index_of(session_.scan()->volume.geometry(), position);
    };
    return {
        [this, index](const Vec3d& position) -> std::optional<QPointF> {
            const Vec3d at = index(position);
            if (std::abs(at[static_cast<std::size_t>(slice_.through)] - static_cast<double>(number_)) >= 1)
                return {};
            return widget_point(at);
        },
        [this, index](const Vec3d& position, const QPoint& point) -> std::optional<Vec3d> {
            const Vec3d to = slice_.to_index(to_widget().inverted().map(QPointF(point)), index(position));
            if (!in_scan(to)) return {};
            return session_.scan()->volume.geometry().physical(to);
        },
        [this](const QPoint& point) { press(point); }};
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

QString SliceView::value_at(const QPointF& slice_point) const {
    const double u = std::round(slice_point.x()), v = std::round(slice_point.y());
    const auto width = static_cast<double>(slice_.size[0]), height = static_cast<double>(slice_.size[1]);
    if (!(u >= 0 && v >= 0 && u < width && v < height)) return {};
    const auto text = [&] {
        if (!slab_samples_.empty()) {
            const double value = slab_samples_[static_cast<std::size_t>(v * width + u)];
            return slab_.mode == Slab::Mode::mean ? QString::number(value, 'g', 4) : value_text(value);
        }
        Vec3d index = slice_.to_index({u, v}, session_.crosshair());
        index[static_cast<std::size_t>(slice_.through)] = static_cast<double>(number_);
        return value_text(sample_at(session_.scan()->volume, std::llround(index[0]), std::llround(index[1]),
                                    std::llround(index[2])));
    };
    return text() + (session_.scan()->hounsfield ? " HU" : "");
}

QString SliceView::readout() const {
    if (dragging_ == Qt::RightButton) return window_text(session_.parameters().window);
    if (!pointer_ || dragging_ != Qt::NoButton) return value_at(slice_.to_slice(session_.crosshair()));
    const QString value = value_at(to_widget().inverted().map(*pointer_));
    if (value.isEmpty()) return {};
    Vec3d index = index_at(*pointer_);
    index[static_cast<std::size_t>(slice_.through)] = static_cast<double>(number_);
    const auto sample = [&](std::size_t axis) { return QString::number(std::llround(index[axis])); };
    return QString("%1  (%2, %3, %4)").arg(value, sample(0), sample(1), sample(2));
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

void SliceView::mousePressEvent(QMouseEvent* event) {
    if (!session_.scan()) return;
    last_ = event->localPos();
    if (crop_sides_at(last_).empty() && mark_drag_.handle_event(*event)) return;
    dragging_ = event->button() == Qt::LeftButton && event->modifiers() & Qt::ShiftModifier ? Qt::MiddleButton
                                                                                            : event->button();
    if (dragging_ == Qt::LeftButton) {
        dragged_sides_ = crop_sides_at(last_);
        dragged_sides_.empty() ? press(last_) : session_.end_step();
    }
}

void SliceView::mouseDoubleClickEvent(QMouseEvent* event) {
    if (!session_.scan()) return;
    const bool plain = event->button() == Qt::LeftButton && event->modifiers() == Qt::NoModifier;
    if (!plain || session_.tool() != Tool::navigate) return mousePressEvent(event);
    session_.set_crosshair(before_press_);
    emit double_clicked();
}

// Sets the crosshair or picks a position to measure.
void SliceView::press(const QPointF& point) {
    before_press_ = session_.crosshair();
    Vec3d index = index_at(point);
    if (navigates()) return session_.set_crosshair(index);
    if (!in_scan(index)) return;
    // The crosshair may be between two slices, but the position must be on the displayed one.
    index[static_cast<std::size_t>(slice_.through)] = static_cast<double>(number_);
    session_.click(session_.scan()->volume.geometry().physical(index));
}

bool SliceView::in_scan(const Vec3d& index) const {
    const auto& dims = session_.scan()->volume.geometry().dims;
    for (std::size_t a = 0; a < 3; ++a) {
        if (!(index[a] >= -0.5 && index[a] <= static_cast<double>(dims[a]) - 0.5)) return false;
    }
    return true;
}

void SliceView::mouseMoveEvent(QMouseEvent* event) {
    if (!session_.scan()) return;
    pointer_ = event->localPos();
    if (mark_drag_.handle_event(*event)) return;
    if (dragging_ == Qt::NoButton) {
        update(0, height() - 24, width(), 24);  // the value
        return update_cursor(*pointer_);
    }
    const QPointF moved = event->localPos() - last_;
    last_ = event->localPos();
    if (dragging_ == Qt::LeftButton && !dragged_sides_.empty()) {
        const Vec3d index = index_at(last_);
        for (const CropSide& side : dragged_sides_)
            session_.move_crop_side(side, index[side.axis] + (side.upper ? -0.5 : 0.5));
    } else if (dragging_ == Qt::LeftButton && navigates()) {
        session_.set_crosshair(index_at(last_));
    } else if (dragging_ == Qt::MiddleButton) {
        pan_ += moved / fitting_scale();
        update();
    } else if (dragging_ == Qt::RightButton) {
        session_.change(tr("window"), "window", [&](Parameters& p) {
            p.window.width = std::max(p.window.width * std::exp(moved.x() / 150), 1e-6);
            p.window.centre += moved.y() / 300 * p.window.width;
        });
    }
}

void SliceView::mouseReleaseEvent(QMouseEvent* event) {
    if (mark_drag_.handle_event(*event)) return;
    if (dragging_ == Qt::RightButton || !dragged_sides_.empty()) session_.end_step();
    if (!dragged_sides_.empty()) surfaces_.settle();
    dragged_sides_.clear();
    dragging_ = Qt::NoButton;
    update();
}

void SliceView::leaveEvent(QEvent*) {
    pointer_.reset();
    update();
}

void SliceView::wheelEvent(QWheelEvent* event) {
    const double steps = event->angleDelta().y() / 120.0;
    if (event->modifiers() & Qt::ControlModifier) {
        zoom_about(event->position(), zoom_ * std::pow(1.2, steps));
        emit zoomed(zoom_);
    } else {
        // Fine wheels and touchpads send fractions of a step.
        wheel_ += steps;
        const double slices = std::trunc(wheel_);
        wheel_ -= slices;
        if (slices != 0) go(slices);
    }
    event->accept();
}

void SliceView::zoom_about(const QPointF& point, double zoom) {
    const double before = zoom_;
    zoom_ = std::clamp(zoom, 0.2, 40.0);
    const QPointF from_middle = (point - QPointF(width() / 2.0, height() / 2.0)) / fitting_scale();
    pan_ = from_middle - (from_middle - pan_) * (zoom_ / before);
    update();
}

void SliceView::zoom_to(double zoom) {
    if (session_.scan()) zoom_about(widget_point(session_.crosshair()), zoom);
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
