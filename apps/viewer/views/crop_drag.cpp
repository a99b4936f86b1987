// Maps mouse positions to indices on the axis of the dragged side.
#include "crop_drag.h"

#include <cmath>

#include "model/camera.h"
#include "scene_parts.h"

namespace marrow::viewer {
namespace {

constexpr double kReach = 11;  // pixels within which a press takes a handle

}  // namespace

std::optional<CropSide> CropDrag::side_at(const QPoint& point) const {
    if (!session_.scan() || session_.tool() != Tool::crop) return {};
    std::optional<CropSide> nearest;
    double distance = kReach;
    for (const CropSide& side : kCropSides) {
        const Vec3d index = CropBox::handle(session_.crop(), side);
        const std::optional<QPointF> at =
            projection_.widget_point(session_.scan()->volume.geometry().physical(index));
        if (!at || std::hypot(at->x() - point.x(), at->y() - point.y()) > distance) continue;
        distance = std::hypot(at->x() - point.x(), at->y() - point.y());
        nearest = side;
    }
    return nearest;
}

// The index on the axis of the side that is nearest to the ray through the point.
std::optional<double> CropDrag::index_at(const CropSide& side, const QPoint& point) const {
    const Geometry& geometry = session_.scan()->volume.geometry();
    Vec3d start = CropBox::handle(session_.crop(), side);
    start[side.axis] = 0;
    const Vec3d step = column(geometry.index_to_physical(), side.axis);
    return nearest_on_line(geometry.physical(start), step, projection_.ray_at(point));
}

bool CropDrag::handle_event(const QMouseEvent& mouse) {
    if (mouse.type() == QEvent::MouseButtonPress && mouse.button() == Qt::LeftButton) {
        side_ = side_at(mouse.pos());
        if (!side_) return false;
        session_.end_step();
        const SampleBox box = session_.crop();
        const auto sample = static_cast<double>((side_->upper ? box.last : box.first)[side_->axis]);
        grip_ = sample - index_at(*side_, mouse.pos()).value_or(sample);
        return true;
    }
    if (!side_) return false;
    if (mouse.type() == QEvent::MouseMove) {
        if (const auto index = index_at(*side_, mouse.pos())) session_.move_crop_side(*side_, *index + grip_);
        return true;
    }
    if (mouse.type() == QEvent::MouseButtonRelease && mouse.button() == Qt::LeftButton) {
        side_.reset();
        session_.end_step();
        surfaces_.settle();
        return true;
    }
    return false;
}

}  // namespace marrow::viewer
