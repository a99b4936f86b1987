// Finds the end under the mouse and moves it.
#include "mark_drag.h"

#include <cmath>

namespace marrow::viewer {
namespace {

constexpr double kReach = 7;  // pixels within which a press takes an end
constexpr int kClick = 3;     // pixels; a longer move is a drag, not a click

}  // namespace

std::optional<MarkDrag::End> MarkDrag::end_at(const QPoint& point) const {
    std::optional<End> nearest;
    double distance = kReach;
    const std::vector<Measurement>& measurements = session_.parameters().measurements;
    for (std::size_t m = 0; m < measurements.size(); ++m) {
        for (std::size_t p = 0; p < measurements[m].points.size(); ++p) {
            const Vec3d& position = measurements[m].points[p];
            const std::optional<QPointF> at = view_.widget_point(position);
            if (!at || std::hypot(at->x() - point.x(), at->y() - point.y()) > distance) continue;
            distance = std::hypot(at->x() - point.x(), at->y() - point.y());
            nearest = {m, p, position};
        }
    }
    return nearest;
}

void MarkDrag::move_to(const QPoint& point) {
    const std::optional<Vec3d> position = view_.moved(end_->position, point);
    if (!position) return;
    session_.change(QObject::tr("move measurement"), "move measurement", [&](Parameters& p) {
        if (end_->measurement >= p.measurements.size()) return;  // undone during the drag
        std::vector<Vec3d>& points = p.measurements[end_->measurement].points;
        if (end_->point < points.size()) points[end_->point] = *position;
    });
}

bool MarkDrag::handle_event(const QMouseEvent& mouse) {
    if (mouse.type() == QEvent::MouseButtonPress && mouse.button() == Qt::LeftButton &&
        mouse.modifiers() == Qt::NoModifier) {
        end_ = end_at(mouse.pos());
        pressed_ = mouse.pos();
        moving_ = false;
        if (end_) session_.end_step();
        return end_.has_value();
    }
    if (!end_) return false;
    if (mouse.type() == QEvent::MouseMove) {
        moving_ = moving_ || (mouse.pos() - pressed_).manhattanLength() > kClick;
        if (moving_) move_to(mouse.pos());
        return true;
    }
    if (mouse.type() == QEvent::MouseButtonRelease && mouse.button() == Qt::LeftButton) {
        end_.reset();
        session_.end_step();
        if (!moving_) view_.click(mouse.pos());
        return true;
    }
    return false;
}

}  // namespace marrow::viewer
