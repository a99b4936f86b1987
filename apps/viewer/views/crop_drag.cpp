#include "crop_drag.h"

#include <cmath>

#include "model/camera.h"
#include "scene_parts.h"
#include "surface_view.h"
#include "model/vectors.h"

namespace marrow::viewer {

namespace {

constexpr double kReach = 11;  // pixels from a handle at which a hand takes it

}  // namespace

std::optional<CropSide> CropDrag::side_at(const QPoint& place) const {
    if (!session_.scan() || session_.tool() != Tool::crop) return {};
    std::optional<CropSide> nearest;
    double distance = kReach;
    for (const CropSide& side : kCropSides) {
        const Vec3d index = CropBox::handle(session_.crop(), side);
        const QPointF to = view_.place_of(session_.scan()->volume.geometry().physical(index)) - place;
        if (std::hypot(to.x(), to.y()) > distance) continue;
        distance = std::hypot(to.x(), to.y());
        nearest = side;
    }
    return nearest;
}

// The index at which the line along which the side moves passes nearest to what is under the hand.
std::optional<double> CropDrag::index_at(const CropSide& side, const QPoint& place) const {
    const Geometry& geometry = session_.scan()->volume.geometry();
    Vec3d start = CropBox::handle(session_.crop(), side);
    start[side.axis] = 0;
    return along_line(geometry.physical(start), step_along(geometry, side.axis), view_.ray_at(place));
}

bool CropDrag::take(const QMouseEvent& mouse) {
    if (mouse.type() == QEvent::MouseButtonPress && mouse.button() == Qt::LeftButton) {
        side_ = side_at(mouse.pos());
        if (!side_) return false;
        session_.seal();
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
        session_.seal();
        surfaces_.settle();
        return true;
    }
    return false;
}

}  // namespace marrow::viewer
