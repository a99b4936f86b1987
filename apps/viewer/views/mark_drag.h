/// Drags the ends of measurements.
#pragma once

#include <functional>
#include <optional>

#include <QMouseEvent>

#include "model/session.h"

namespace marrow::viewer {

/// How a view shows positions, LPS mm.
struct MarkView {
    /// The point of the widget at which a position is drawn; nothing if it cannot be dragged there.
    std::function<std::optional<QPointF>(const Vec3d&)> widget_point;
    /// Where a position moves to if it is dragged to a point of the widget; nothing if it stays.
    std::function<std::optional<Vec3d>(const Vec3d&, const QPoint&)> moved;
    /// Called if the mouse did not move between press and release.
    std::function<void(const QPoint&)> click;
};

class MarkDrag {
  public:
    MarkDrag(Session& session, MarkView view) : session_(session), view_(std::move(view)) {}

    /// Moves an end of a measurement from a press on it to the release. Returns whether the event was part of
    /// such a drag.
    bool handle_event(const QMouseEvent& mouse);
    bool active() const { return end_.has_value(); }
    /// Whether a press at this point of the widget would start a drag.
    bool reaches(const QPoint& point) const { return end_at(point).has_value(); }

  private:
    struct End {
        std::size_t measurement, point;
        Vec3d position;
    };
    std::optional<End> end_at(const QPoint& point) const;
    void move_to(const QPoint& point);

    Session& session_;
    const MarkView view_;
    std::optional<End> end_;  // being dragged
    QPoint pressed_;
    bool moving_ = false;
};

}  // namespace marrow::viewer
