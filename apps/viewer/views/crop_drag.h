/// Drags the sides of the crop box in the 3D view.
#pragma once

#include <functional>
#include <optional>

#include <QMouseEvent>

#include "model/ray_pick.h"
#include "model/surfaces.h"

namespace marrow::viewer {

/// How a 3D view maps between space and its widget.
struct Projection {
    /// The point of the widget at which a position is drawn; nothing behind the camera.
    std::function<std::optional<QPointF>(const Vec3d&)> widget_point;
    std::function<Ray(const QPoint&)> ray_at;  ///< from the camera through a point of the widget
};

class CropDrag {
  public:
    CropDrag(Session& session, Surfaces& surfaces, Projection projection)
        : session_(session), surfaces_(surfaces), projection_(std::move(projection)) {}

    /// Moves a side of the crop box from a press on its handle to the release. Returns whether the event was
    /// part of such a drag.
    bool handle_event(const QMouseEvent& mouse);

  private:
    std::optional<CropSide> side_at(const QPoint& point) const;
    std::optional<double> index_at(const CropSide& side, const QPoint& point) const;

    Session& session_;
    Surfaces& surfaces_;
    const Projection projection_;
    std::optional<CropSide> side_;  // being dragged
    double grip_ = 0;               // from the pressed index to the outer sample of that side
};

}  // namespace marrow::viewer
