// Follows the session and handles mouse and keys.
#include "slice_view.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QWheelEvent>

#include "model/number_text.h"
#include "window_presets.h"

namespace marrow::viewer {

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
    const double black = window_.centre - window_.width / 2, scale = window_.greys_per_value();
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
        // Without a width, no drag would widen the window again.
        const double narrowest = 1e-9 * window_of_all_values(session_.scan()->histogram).width;
        session_.change(tr("window"), "window", [&](Parameters& p) {
            p.window.width = std::max(p.window.width * std::exp(moved.x() / 150), narrowest);
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
